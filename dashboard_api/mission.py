"""The routes of the mission: what its tree does, and commands to the executor."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends
from starlette.responses import Response

from bus_schema.errors import BadMessage
from bus_schema.messages.mission import Command, MissionCommand, MissionRequest, MissionStatus
from bus_schema.records import record_shape
from dashboard_api.adaptations import request_body
from dashboard_api.body import json_object, optional_json_object, told, unknown_fields
from dashboard_api.json_replies import reply, shown
from dashboard_api.manager import Refused, Services
from dashboard_api.problems import CONFLICT, Problem, declared, malformed

TEXTS = {name: shape.json_schema() for name, shape in record_shape(MissionCommand).fields if name != "command"}
LOAD_SCHEMA = {"type": "object", "properties": TEXTS, "required": ["tree"], "additionalProperties": False}
NOTHING_SCHEMA = {"type": "object", "properties": {}, "additionalProperties": False}
TREE_EXAMPLE = (
    '<root BTCPP_format="4" main_tree_to_execute="Main"><BehaviorTree ID="Main"><AlwaysSuccess/></BehaviorTree></root>'
)
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
        return reply(_asked(services, "mission/status", MissionRequest()))

    @router.post(
        "/mission/load",
        responses={**shown(MissionStatus, "The mission"), **declared(409, 413, 415, 422, 503)},
        openapi_extra=request_body(LOAD_SCHEMA, {"tree": TREE_EXAMPLE}),
    )
    def load(body: Annotated[dict[str, Any], Depends(json_object)]) -> Response:
        """Load a behaviour tree (BehaviorTree.CPP XML, version 4)."""
        return _command(services, Command.LOAD, body, ("tree", "main"))

    for command, meaning in MEANINGS.items():
        _add_command(router, services, command, meaning)
    return router


def _add_command(router: APIRouter, services: Services, command: Command, meaning: str) -> None:
    def tell(body: Annotated[dict[str, Any], Depends(optional_json_object)]) -> Response:
        return _command(services, command, body, ())

    router.add_api_route(
        f"/mission/{command.value}",
        tell,
        methods=["POST"],
        name=f"{command.value}_mission",
        description=meaning,
        responses={**shown(MissionStatus, "The mission"), **declared(409, 413, 415, 422, 503)},
        openapi_extra=request_body(NOTHING_SCHEMA, {}, required=False),
    )


def _command(services: Services, command: Command, body: dict[str, Any], known: tuple[str, ...]) -> Response:
    wrong = unknown_fields(body, known)
    if wrong:
        raise malformed(*wrong)
    if command is Command.LOAD and "tree" not in body:
        raise malformed(told(BadMessage("is missing", ("tree",))))
    try:
        request = record_shape(MissionCommand).unpack({**body, "command": command.value})
    except BadMessage as error:
        raise malformed(told(error)) from None
    return reply(_asked(services, "mission/command", request))


def _asked(services: Services, service: str, request: object) -> MissionStatus:
    try:
        return services.ask(service, request, MissionStatus)
    except Refused as refusal:
        raise Problem(CONFLICT, str(refusal)) from None
