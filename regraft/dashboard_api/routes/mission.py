"""The routes of the mission: what its tree does, its blackboards, and commands to the executor."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    BlackboardRequest,
    Command,
    MissionCommand,
    MissionRequest,
    MissionStatus,
    WriteBlackboard,
)
from regraft.dashboard_api.backend.manager import Services
from regraft.dashboard_api.http.body import json_object, optional_json_object, told, unknown_fields
from regraft.dashboard_api.http.json_replies import reply, shown
from regraft.dashboard_api.http.problems import declared, malformed
from regraft.dashboard_api.routes.adaptations import request_body

TEXTS = {name: shape.json_schema() for name, shape in record_shape(MissionCommand).fields if name != "command"}
TREE = {**TEXTS["tree"], "minLength": 1}
LOAD_SCHEMA = {
    "type": "object",
    "properties": {**TEXTS, "tree": TREE},
    "required": ["tree"],
    "additionalProperties": False,
}
NOTHING_SCHEMA = {"type": "object", "properties": {}, "additionalProperties": False}
TREE_EXAMPLE = (
    '<root BTCPP_format="4" main_tree_to_execute="Main"><BehaviorTree ID="Main"><AlwaysSuccess/></BehaviorTree></root>'
)
WRITE_SCHEMA = {"type": "object", "description": "New values by entry; null removes one; the others keep theirs"}
TAKE_A_TREE = {
    Command.LOAD: "Load a behaviour tree (BehaviorTree.CPP XML, version 4) in place of the present one.",
    Command.CHECK: "Load a behaviour tree as the executor would, and forget it: says what is wrong, changes nothing.",
    Command.SWAP: "Have another tree take over from the running one at once; the root blackboard is carried over.",
}
Board = Annotated[str, Query(description="The path of a sub-tree; the root's board by default", max_length=1000)]
MEANINGS = {
    Command.START: "Tick the loaded tree from now on.",
    Command.PAUSE: "Tick no more for now; running nodes stay as they are.",
    Command.STEP: "Tick the paused tree once.",
    Command.HALT: "Halt the tree: running nodes are stopped.",
}


def routes(services: Services) -> APIRouter:
    """Return the routes."""
    router = APIRouter(tags=["mission"])

    @router.get("/mission", responses={**shown(MissionStatus, "The mission"), **declared(409, 503)})
    def show_mission() -> Response:
        """The mission: tree, statuses of its nodes, blackboard."""
        return reply(services.ask("mission/status", MissionRequest(), MissionStatus))

    @router.get(
        "/mission/blackboard", responses={**shown(BlackboardEntries, "The entries"), **declared(404, 409, 422, 503)}
    )
    def read_blackboard(
        key: Annotated[str, Query(description="One entry; all by default", max_length=200)] = "", board: Board = ""
    ) -> Response:
        """The entries of a blackboard: value, type, number of writes, age."""
        return reply(services.ask("mission/blackboard", BlackboardRequest(key, board), BlackboardEntries))

    @router.patch(
        "/mission/blackboard",
        responses={**shown(BlackboardEntries, "The entries written"), **declared(404, 409, 413, 415, 422, 503)},
        openapi_extra=request_body(WRITE_SCHEMA, {"charging_wanted": 1}),
    )
    def write_blackboard(body: Annotated[dict[str, Any], Depends(json_object)], board: Board = "") -> Response:
        """Write entries of a blackboard, all or none; a value must fit its entry's type."""
        return reply(services.ask("mission/write", WriteBlackboard(body, board), BlackboardEntries))

    for command, meaning in TAKE_A_TREE.items():
        _add_command(router, services, command, meaning)
    for command, meaning in MEANINGS.items():
        _add_command(router, services, command, meaning)
    return router


def _add_command(router: APIRouter, services: Services, command: Command, meaning: str) -> None:
    takes_tree = command in TAKE_A_TREE

    def tell(body: Annotated[dict[str, Any], Depends(optional_json_object)]) -> Response:
        return _command(services, command, body, ())

    def tell_with_tree(body: Annotated[dict[str, Any], Depends(json_object)]) -> Response:
        return _command(services, command, body, tuple(TEXTS))

    router.add_api_route(
        f"/mission/{command.value}",
        tell_with_tree if takes_tree else tell,
        methods=["POST"],
        name=f"{command.value}_mission",
        description=meaning,
        responses={**shown(MissionStatus, "The mission"), **declared(409, 413, 415, 422, 503)},
        openapi_extra=request_body(LOAD_SCHEMA, {"tree": TREE_EXAMPLE})
        if takes_tree
        else request_body(NOTHING_SCHEMA, {}, required=False),
    )


def _command(services: Services, command: Command, body: dict[str, Any], known: tuple[str, ...]) -> Response:
    wrong = unknown_fields(body, known)
    if wrong:
        raise malformed(*wrong)
    if command in TAKE_A_TREE and body.get("tree", "") == "":
        raise malformed(told(BadMessage("is empty" if "tree" in body else "is missing", ("tree",))))
    try:
        request = record_shape(MissionCommand).unpack({**body, "command": command.value})
    except BadMessage as error:
        raise malformed(told(error)) from None
    return reply(services.ask("mission/command", request, MissionStatus))
