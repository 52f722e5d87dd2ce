"""The routes that show the system."""

from __future__ import annotations

import secrets
from typing import Annotated, Any

from fastapi import APIRouter, Header, Path, Query, Response

from regraft.bus_schema.messages.management.modes import SystemModes
from regraft.bus_schema.messages.protocol.control import AskQualities, Qualities
from regraft.bus_schema.messages.protocol.host import LogLines
from regraft.bus_schema.model.architecture import Architecture
from regraft.client.diff import ArchitectureDiff, diff
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.overview import Overview
from regraft.dashboard_api.backend.views import (
    ComponentDetails,
    ComponentList,
    HostList,
    QualityList,
    SystemOverview,
    TopicList,
)
from regraft.dashboard_api.http.body import JsonRoute
from regraft.dashboard_api.http.bus_types import Fields, JsonObject, Shown, fields_of
from regraft.dashboard_api.http.problems import declared
from regraft.dashboard_api.routes.bodies import example

TOO_LARGE = 2**63
"""No revision is this large. Limits are floats in the document: this one is exact there, 2**63 - 1 is not."""

QualitiesBody = Annotated[
    JsonObject,
    Fields("QualitiesBody", fields_of(AskQualities)),
    example({"parameters": {"max_velocity": 0.1}, "context": {"darkness": 0.5}}),
]
ComponentName = Annotated[str, Path(description="A component's name", examples=["navigator"])]
Revision = Annotated[int, Query(ge=0, lt=TOO_LARGE, examples=[12])]


def _never_null(schema: dict[str, Any]) -> None:
    schema.update(schema.pop("anyOf")[0])


RevisionOrNone = Annotated[int | None, Query(ge=0, lt=TOO_LARGE, examples=[12], json_schema_extra=_never_null)]
"""A revision that may be left out: null cannot be sent in a query."""
OfRobot = Annotated[str, Query(description="Only what belongs to this robot among several", max_length=64)]
NOT_MODIFIED: dict[int | str, dict[str, Any]] = {304: {"description": "The caller has this architecture already"}}


def etag(architecture: Architecture, run: str) -> str:
    """Return the entity tag of an architecture: its revision, the gateway's ``run``, and what is not confirmed yet.

    Another run of the system has other architectures under the same revisions.
    """
    return f'"{"-".join(filter(None, (str(architecture.revision), run, architecture.unconfirmed)))}"'


def routes(overview: Overview, manager: Manager) -> APIRouter:
    """Return the routes."""
    router = APIRouter(tags=["status"], route_class=JsonRoute)
    run = secrets.token_hex(4)

    @router.get("/system", response_description="The system", responses=declared(422))
    def show_system() -> Shown[SystemOverview]:
        """The system in one answer: components by state, hosts, clock, problems."""
        return overview.system()

    @router.get("/components", response_description="The components", responses=declared(404, 422, 503))
    def list_components(robot: OfRobot = "") -> Shown[ComponentList]:
        """The components, all or a robot's: as they should be, and as they are."""
        return overview.components(robot)

    @router.get("/components/{name}", response_description="The component", responses=declared(404, 422))
    def show_component(name: ComponentName) -> Shown[ComponentDetails]:
        """A component: its specification, status, process, parameters and connections."""
        return overview.component(name)

    @router.get("/components/{name}/qualities", response_description="Its qualities", responses=declared(404, 422, 503))
    def show_qualities(name: ComponentName) -> Shown[Qualities]:
        """The quality attributes that a component gives now, and those that it estimates for its parameters."""
        return overview.qualities(name, AskQualities())

    @router.post(
        "/components/{name}/qualities",
        response_description="Its qualities",
        responses=declared(404, 413, 415, 422, 503),
    )
    def estimate_qualities(name: ComponentName, body: QualitiesBody) -> Shown[Qualities]:
        """The same with some parameters changed, in a context; nothing is touched."""
        return overview.qualities(name, AskQualities(**body))

    @router.get("/qualities", response_description="The qualities", responses=declared(404, 422, 503))
    def list_qualities(robot: OfRobot = "") -> Shown[QualityList]:
        """The qualities that components measure, all or a robot's: the latest value, or why it is unknown."""
        return overview.measured(robot)

    @router.get("/modes", response_description="The modes", responses=declared(404, 422, 503))
    def list_modes(
        robot: OfRobot = "",
        reachable: Annotated[bool, Query(description="check which could be entered now, too")] = False,
    ) -> Shown[SystemModes]:
        """The modes of the system, its robots and components: asked for, actual, available and reachable ones."""
        return overview.modes(robot, reachable=reachable)

    @router.get("/components/{name}/logs", response_description="The last lines", responses=declared(404, 422, 503))
    def show_logs(name: ComponentName, lines: Annotated[int, Query(ge=1, le=10_000)] = 100) -> Shown[LogLines]:
        """The last lines of a component's log, oldest first."""
        return LogLines(name, overview.logs(name, lines))

    @router.get("/topics", response_description="The topics", responses=declared(404, 422, 503))
    def list_topics(robot: OfRobot = "") -> Shown[TopicList]:
        """The topics, all or those of a robot: type, rate, reliability, who writes and who reads."""
        return overview.topics(robot)

    @router.get("/hosts", response_description="All hosts", responses=declared(422))
    def list_hosts(
        measured: Annotated[bool, Query(description="measure what their components take, too")] = False,
    ) -> Shown[HostList]:
        """All hosts, their processes, what they offer and what their components need."""
        return overview.hosts(measured=measured)

    @router.get(
        "/architecture",
        response_model=Shown[Architecture],
        response_description="The architecture",
        responses={**NOT_MODIFIED, **declared(404, 422, 503)},
    )
    def show_architecture(
        response: Response, revision: RevisionOrNone = None, if_none_match: Annotated[str, Header()] = ""
    ) -> Response | Architecture:
        """The architecture, now or at a revision. The ETag begins with its revision; send it back as ``If-Match``."""
        architecture = manager.architecture(revision)
        tag = etag(architecture, run)
        if tag in (each.strip().removeprefix("W/") for each in if_none_match.split(",")):
            return Response(status_code=304, headers={"ETag": tag})
        response.headers["ETag"] = tag
        return architecture

    @router.get("/architecture/diff", response_description="The differences", responses=declared(404, 422, 503))
    def show_diff(
        before: Annotated[Revision, Query(alias="from")],
        after: Annotated[RevisionOrNone, Query(alias="to", description="the current one if left out")] = None,
    ) -> Shown[ArchitectureDiff]:
        """How two revisions of the architecture differ, field by field."""
        return diff(manager.architecture(before), manager.architecture(after))

    return router
