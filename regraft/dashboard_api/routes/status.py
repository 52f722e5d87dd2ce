"""The routes that show the system."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Path, Query
from starlette.responses import Response

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.control import AskQualities, Qualities
from regraft.bus_schema.messages.protocol.host import LogLines
from regraft.bus_schema.model.architecture import Architecture
from regraft.client.diff import ArchitectureDiff, diff
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.overview import Overview
from regraft.dashboard_api.backend.views import ComponentDetails, ComponentList, HostList, SystemOverview, TopicList
from regraft.dashboard_api.http.body import json_object, told
from regraft.dashboard_api.http.json_replies import reply, shown
from regraft.dashboard_api.http.problems import declared, malformed
from regraft.dashboard_api.routes.adaptations import request_body

MAX_REVISION = 2**63 - 1
QUALITIES_EXAMPLE = {"parameters": {"max_velocity": 0.1}, "context": {"darkness": 0.5}}

ComponentName = Annotated[str, Path(description="A component's name", examples=["navigator"])]
Revision = Annotated[int, Query(ge=0, le=MAX_REVISION, examples=[12])]
NOT_MODIFIED: dict[int | str, dict[str, Any]] = {304: {"description": "The caller has this revision already"}}


def etag(revision: int) -> str:
    """Return the entity tag of a revision of the architecture."""
    return f'"{revision}"'


def routes(overview: Overview, manager: Manager) -> APIRouter:
    """Return the routes."""
    router = APIRouter(tags=["status"])

    @router.get("/system", responses={**shown(SystemOverview, "The system"), **declared()})
    def show_system() -> Response:
        """The system in one answer: components by state, hosts, clock, problems."""
        return reply(overview.system())

    @router.get("/components", responses={**shown(ComponentList, "All components"), **declared()})
    def list_components() -> Response:
        """All components: as they should be, and as they are."""
        return reply(overview.components())

    @router.get("/components/{name}", responses={**shown(ComponentDetails, "The component"), **declared(404, 422)})
    def show_component(name: ComponentName) -> Response:
        """A component: its specification, status, process, parameters and connections."""
        return reply(overview.component(name))

    @router.get(
        "/components/{name}/qualities",
        responses={**shown(Qualities, "Its qualities"), **declared(404, 422, 503)},
    )
    def show_qualities(name: ComponentName) -> Response:
        """The quality attributes that a component gives now, and those that it estimates for its parameters."""
        return reply(overview.qualities(name, AskQualities()))

    @router.post(
        "/components/{name}/qualities",
        responses={**shown(Qualities, "Its qualities"), **declared(404, 413, 415, 422, 503)},
        openapi_extra=request_body(record_shape(AskQualities).json_schema(), QUALITIES_EXAMPLE),
    )
    def estimate_qualities(name: ComponentName, body: Annotated[dict[str, Any], Depends(json_object)]) -> Response:
        """The same with some parameters changed, in a context; nothing is touched."""
        try:
            asked = codec.from_plain(body, AskQualities)
        except BadMessage as error:
            raise malformed(told(error)) from None
        return reply(overview.qualities(name, asked))

    @router.get("/components/{name}/logs", responses={**shown(LogLines, "The last lines"), **declared(404, 422, 503)})
    def show_logs(name: ComponentName, lines: Annotated[int, Query(ge=1, le=10_000)] = 100) -> Response:
        """The last lines of a component's log, oldest first."""
        return reply(LogLines(name, overview.logs(name, lines)))

    @router.get("/topics", responses={**shown(TopicList, "All topics"), **declared(503)})
    def list_topics() -> Response:
        """All topics: type, rate, reliability, who writes and who reads."""
        return reply(overview.topics())

    @router.get("/hosts", responses={**shown(HostList, "All hosts"), **declared()})
    def list_hosts() -> Response:
        """All hosts and their processes."""
        return reply(overview.hosts())

    @router.get(
        "/architecture",
        responses={**shown(Architecture, "The architecture"), **NOT_MODIFIED, **declared(404, 422, 503)},
    )
    def show_architecture(
        revision: Revision | None = None, if_none_match: Annotated[str | None, Header()] = None
    ) -> Response:
        """The architecture, now or at a revision. Its revision is the ETag; send it back as ``If-Match``."""
        architecture = manager.architecture(revision)
        tag = etag(architecture.revision)
        if if_none_match is not None and tag in (t.strip().removeprefix("W/") for t in if_none_match.split(",")):
            return Response(status_code=304, headers={"ETag": tag})
        return reply(architecture, headers={"ETag": tag})

    @router.get(
        "/architecture/diff",
        responses={**shown(ArchitectureDiff, "The differences"), **declared(404, 422, 503)},
    )
    def show_diff(
        before: Annotated[Revision, Query(alias="from")],
        after: Annotated[Revision | None, Query(alias="to", description="the current one if left out")] = None,
    ) -> Response:
        """How two revisions of the architecture differ, field by field."""
        return reply(diff(manager.architecture(before), manager.architecture(after)))

    return router
