"""The application: all routes under ``/api/v1``, guarded, documented, every error a problem."""

from __future__ import annotations

from typing import Any

from fastapi import Depends, FastAPI
from fastapi.dependencies import models

from regraft.dashboard_api.backend.event_buffer import EventBuffer
from regraft.dashboard_api.backend.manager import Manager, Services
from regraft.dashboard_api.backend.metacontrollers import Metacontrollers
from regraft.dashboard_api.backend.missions import Missions
from regraft.dashboard_api.backend.overview import Overview
from regraft.dashboard_api.http import problems
from regraft.dashboard_api.http.authentication import Callers
from regraft.dashboard_api.http.authorization import Authorization
from regraft.dashboard_api.http.document import openapi_document
from regraft.dashboard_api.http.guard import Guard
from regraft.dashboard_api.http.head import Head
from regraft.dashboard_api.http.queries import check_query
from regraft.dashboard_api.routes import (
    adaptations,
    changes,
    events,
    mission,
    mission_events,
    objectives,
    pages,
    planners,
    status,
)
from regraft.dashboard_api.routes.mission_events import MissionFeeds

PREFIX = "/api/v1"


def forget_functions() -> None:
    """Have FastAPI forget the functions that it has met: each keeps the whole of its application, which is 3 MB."""
    for kept in vars(models).values():
        if hasattr(kept, "cache_clear"):
            kept.cache_clear()


def build(services: Services, buffer: EventBuffer, callers: Callers, address: str) -> FastAPI:
    """Return the application that is to be served at ``address``, where ``callers`` may act."""
    manager, missions = Manager(services), Missions(services)
    # No page of FastAPI's: it would run scripts from elsewhere on this origin, which may adapt the robot.
    app = FastAPI(openapi_url=f"{PREFIX}/openapi.json", docs_url=None, redoc_url=None)
    document: dict[str, Any] = {}

    def openapi() -> dict[str, Any]:
        if not document:
            document.update(openapi_document(app.routes, PREFIX))
        return document

    app.openapi = openapi  # type: ignore[method-assign]
    for router in (
        status.routes(Overview(services.client, manager), manager),
        adaptations.routes(manager, PREFIX),
        changes.routes(manager, PREFIX),
        mission.routes(missions),
        planners.routes(services, manager),
        objectives.routes(Metacontrollers(services, manager), PREFIX),
        mission_events.routes(MissionFeeds(missions, buffer)),
        events.routes(buffer),
    ):
        app.include_router(
            router, prefix=PREFIX, responses=problems.declared(403, 421, 500), dependencies=[Depends(check_query)]
        )
    app.include_router(pages.routes(services.client.system, openapi, PREFIX))
    problems.install(app)
    # The last one that is added is the first one that a request meets.
    app.add_middleware(Authorization, callers=callers, prefix=PREFIX, document=openapi)
    app.add_middleware(Head)
    app.add_middleware(Guard, address=address)
    return app
