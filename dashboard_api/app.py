"""The application: all routes under ``/api/v1``, guarded, documented, every error a problem."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from starlette.responses import JSONResponse

from dashboard_api import adaptations, changes, events, mission, mission_events, planners, problems, status
from dashboard_api.event_buffer import EventBuffer
from dashboard_api.guard import Guard
from dashboard_api.json_replies import schemas
from dashboard_api.manager import Manager, Services
from dashboard_api.mission_events import MissionFeed
from dashboard_api.overview import Overview

PREFIX = "/api/v1"
HEARTBEAT = 10.0
DESCRIPTION = """Shows a running robot system and takes adaptations.

Whatever changes the architecture is an adaptation: checked as a whole, carried out as a transaction, journalled.
Every error is a problem (RFC 9457) that names all violations."""


def build(services: Services, buffer: EventBuffer, address: str, *, heartbeat: float = HEARTBEAT) -> FastAPI:
    """Return the application that is to be served at ``address``."""
    manager = Manager(services)
    # No /docs page: it would run scripts from elsewhere on this origin, which may adapt the robot.
    app = FastAPI(openapi_url=f"{PREFIX}/openapi.json", docs_url=None, redoc_url=None)
    for router in (
        status.routes(Overview(services.client, manager), manager),
        adaptations.routes(manager, PREFIX),
        changes.routes(manager, PREFIX),
        mission.routes(services),
        planners.routes(services, manager),
        mission_events.routes(MissionFeed(services, manager, buffer.beside()), heartbeat),
        events.routes(buffer, heartbeat),
    ):
        app.include_router(router, prefix=PREFIX, default_response_class=JSONResponse)
    problems.install(app)
    app.add_middleware(Guard, address=address)
    document: dict[str, Any] = {}

    def openapi() -> dict[str, Any]:
        if not document:
            document.update(_document(app))
        return document

    app.openapi = openapi  # type: ignore[method-assign]
    return app


def _document(app: FastAPI) -> dict[str, Any]:
    document = get_openapi(title="Regraft", version="1", description=DESCRIPTION, routes=app.routes)
    document["components"] = {"schemas": {**schemas(), "ProblemDetails": problems.schema()}}
    return document
