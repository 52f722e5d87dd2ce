"""The routes of the mission: what its tree does, its blackboards, and commands to the executor."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import Field

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.records import shape_of
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    BlackboardRequest,
    BreakpointChange,
    BreakpointsRequest,
    Command,
    MissionBreakpoints,
    MissionCommand,
    MissionCounts,
    MissionCountsRequest,
    MissionRequest,
    MissionStatus,
    TickPosition,
    WriteBlackboard,
)
from regraft.bus_schema.model.robots.executors import BLACKBOARD, BREAKPOINTS, COMMAND, COUNTS, STATUS, WRITE
from regraft.dashboard_api.backend.missions import Missions
from regraft.dashboard_api.http.body import JsonRoute
from regraft.dashboard_api.http.bus_types import BodyField, Fields, JsonObject, Shown, Values, fields_of
from regraft.dashboard_api.http.problems import declared
from regraft.dashboard_api.routes.bodies import NoBody, example

TEXTS = fields_of(MissionCommand, "tree", "main", also={"tree": {"minLength": 1}, "main": {"minLength": 1}})
TEXTS_GIVEN = {
    name: BodyField(name, Annotated[text.kind, Field(min_length=1)], required=False) for name, text in TEXTS.items()
}
TreeBody = Annotated[
    JsonObject,
    Fields("TreeBody", TEXTS_GIVEN, any_of=("tree", "main")),
    example({"tree": '<root BTCPP_format="4"><BehaviorTree ID="Main"><AlwaysSuccess/></BehaviorTree></root>'}),
]
BreakpointBody = Annotated[
    JsonObject,
    Fields("BreakpointBody", fields_of(BreakpointsRequest, without=["change"]), any_of=("node",)),
    example({"node": "drive", "position": "before", "once": True}),
]
ResultBody = Annotated[
    JsonObject,
    Fields("ResultBody", fields_of(MissionCommand, "result")),
    example({"result": "failure"}, default_factory=dict),
]
EntriesBody = Annotated[JsonObject, Values(shape_of(PlainValue)), example({"charging_wanted": 1})]
TAKE_A_TREE = {
    Command.LOAD: "Load a behaviour tree (BehaviorTree.CPP XML, version 4) in place of the present one.",
    Command.CHECK: "Load a behaviour tree as the executor would, and forget it: says what is wrong, changes nothing.",
    Command.SWAP: "Have another tree take over from the running one at once; the root blackboard is carried over.",
}
Board = Annotated[str, Query(description="The path of a sub-tree; the root's board by default", max_length=1000)]
Robot = Annotated[
    str,
    Query(
        description="The robot whose mission is meant, or its executor; needed only if several have one", max_length=129
    ),
]
TAKE_A_RESULT = {
    Command.CONTINUE: "Continue a tick that has stopped at a breakpoint; a result is forced on the node there.",
    Command.NEXT: "Continue to the next node that runs, or begin a tick and stop at its first one.",
}
MEANINGS = {
    Command.START: "Tick the loaded tree from now on.",
    Command.PAUSE: "Tick no more for now; running nodes stay as they are.",
    Command.STEP: "Tick the paused tree once.",
    Command.HALT: "Halt the tree: running nodes are stopped.",
}


def routes(missions: Missions) -> APIRouter:
    """Return the routes."""
    router = APIRouter(tags=["mission"], route_class=JsonRoute)

    @router.get("/mission", response_description="The mission", responses=declared(404, 409, 422, 503))
    def show_mission(robot: Robot = "") -> Shown[MissionStatus]:
        """The mission: tree, statuses of its nodes, blackboard."""
        return missions.ask(robot, STATUS, MissionRequest(), MissionStatus)

    @router.get("/mission/counts", response_description="The counts", responses=declared(404, 409, 422, 503))
    def show_counts(robot: Robot = "") -> Shown[MissionCounts]:
        """The ticks, results and changes of each node, if the executor's parameter `counts` is set."""
        return missions.ask(robot, COUNTS, MissionCountsRequest(), MissionCounts)

    @router.delete(
        "/mission/counts", response_description="The counts until now", responses=declared(404, 409, 422, 503)
    )
    def reset_counts(robot: Robot = "") -> Shown[MissionCounts]:
        """Count from zero again; returns what was counted."""
        return missions.ask(robot, COUNTS, MissionCountsRequest(reset=True), MissionCounts)

    @router.get("/mission/blackboard", response_description="The entries", responses=declared(404, 409, 422, 503))
    def read_blackboard(
        key: Annotated[str, Query(description="One entry; all by default", max_length=200)] = "",
        board: Board = "",
        robot: Robot = "",
    ) -> Shown[BlackboardEntries]:
        """The entries of a blackboard: value, type, number of writes, age."""
        return missions.ask(robot, BLACKBOARD, BlackboardRequest(key, board), BlackboardEntries)

    @router.patch(
        "/mission/blackboard",
        response_description="The entries written",
        responses=declared(404, 409, 413, 415, 422, 503),
    )
    def write_blackboard(body: EntriesBody, board: Board = "", robot: Robot = "") -> Shown[BlackboardEntries]:
        """Write entries of a blackboard, all or none; a value must fit its entry's type, and null removes it."""
        return missions.ask(robot, WRITE, WriteBlackboard(body, board), BlackboardEntries)

    for command, meaning in (TAKE_A_TREE | MEANINGS | TAKE_A_RESULT).items():
        _add_command(router, missions, command, meaning)
    _add_breakpoints(router, missions)
    return router


def _add_breakpoints(router: APIRouter, missions: Missions) -> None:
    def ask(robot: str, request: BreakpointsRequest) -> MissionBreakpoints:
        return missions.ask(robot, BREAKPOINTS, request, MissionBreakpoints)

    @router.get("/mission/breakpoints", response_description="The breakpoints", responses=declared(404, 409, 422, 503))
    def list_breakpoints(robot: Robot = "") -> Shown[MissionBreakpoints]:
        """The breakpoints of the mission's tree."""
        return ask(robot, BreakpointsRequest())

    @router.post(
        "/mission/breakpoints",
        response_description="The breakpoints then",
        responses=declared(404, 409, 413, 415, 422, 503),
    )
    def set_breakpoint(body: BreakpointBody, robot: Robot = "") -> Shown[MissionBreakpoints]:
        """Set a breakpoint at a node: its path, a name that it alone has, or its uid. With a result nothing stops."""
        return ask(robot, BreakpointsRequest(BreakpointChange.SET, **body))

    @router.delete(
        "/mission/breakpoints",
        response_description="The breakpoints that are left",
        responses=declared(404, 409, 422, 503),
    )
    def remove_breakpoints(
        node: Annotated[str, Query(description="The node; all breakpoints by default", max_length=1000)] = "",
        position: Annotated[TickPosition, Query(description="Before or after the node")] = TickPosition.BEFORE,
        robot: Robot = "",
    ) -> Shown[MissionBreakpoints]:
        """Remove the breakpoint at a node, or all of them."""
        change = BreakpointChange.REMOVE if node else BreakpointChange.CLEAR
        return ask(robot, BreakpointsRequest(change, node, position))


def _add_command(router: APIRouter, missions: Missions, command: Command, meaning: str) -> None:
    def tell(body: NoBody, robot: Robot = "") -> Shown[MissionStatus]:
        return missions.ask(robot, COMMAND, MissionCommand(command), MissionStatus)

    def tell_with_tree(body: TreeBody, robot: Robot = "") -> Shown[MissionStatus]:
        return missions.ask(robot, COMMAND, MissionCommand(command, **body), MissionStatus)

    def tell_with_result(body: ResultBody, robot: Robot = "") -> Shown[MissionStatus]:
        return missions.ask(robot, COMMAND, MissionCommand(command, **body), MissionStatus)

    with_result = tell_with_result if command in TAKE_A_RESULT else tell
    router.add_api_route(
        f"/mission/{command.value}",
        tell_with_tree if command in TAKE_A_TREE else with_result,
        methods=["POST"],
        name=f"{command.value}_mission",
        description=meaning,
        response_description="The mission",
        responses=declared(404, 409, 413, 415, 422, 503),
    )
