"""The routes of objectives: what metacontrollers are to provide, and what becomes of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, Final
from urllib.parse import quote, urlencode

from fastapi import APIRouter, Body, Depends, Header, Path, Query, Request, Response
from pydantic import conlist

from regraft.bus_schema.encoding.records import shape_of
from regraft.bus_schema.messages.management.objectives import (
    ADD,
    CANCEL,
    CONTEXT,
    EXPLAIN,
    LIST,
    REPORT,
    ContextRequest,
    ContextStatus,
    Explanation,
    ExplanationQuery,
    Objective,
    ObjectivesCancellation,
    ObjectivesQuery,
    ObjectivesRequest,
    ObjectivesStatus,
    ObjectiveStatus,
    ProgressReport,
)
from regraft.dashboard_api.backend.metacontrollers import Metacontrollers
from regraft.dashboard_api.http.adaptation_headers import ActorHeader, actor
from regraft.dashboard_api.http.body import JsonRoute, built
from regraft.dashboard_api.http.bus_types import BodyField, Fields, JsonObject, Shown, checked, fields_of
from regraft.dashboard_api.http.problems import INVALID, Problem, declared, violation
from regraft.dashboard_api.routes.bodies import example
from regraft.dashboard_api.routes.planners import Name as PlannerName
from regraft.dashboard_api.routes.status import OfRobot

LIST_TIMEOUT: Final = 1.0
"""Seconds that the list of objectives waits for each metacontroller."""
MAX_OBJECTIVES: Final = 100
OBJECTIVE_EXAMPLES: Final = {
    "one": {
        "summary": "drive safely, for a task",
        "value": {
            "skill": "to_navigate",
            "name": "patrol_1",
            "requirements": {"safety": 0.5, "energy": 0.5},
            "operators": {"safety": ">="},
            "inputs": {"goal": {"x": 1.0, "y": 2.0}},
            "task": "patrol",
        },
    },
    "several": {
        "summary": "all of them, or none",
        "value": {"objectives": [{"skill": "to_navigate", "name": "patrol_1"}, {"skill": "to_detect"}]},
    },
}
OBJECTIVE: Final = fields_of(Objective)
LISTED: Final = BodyField("objectives", conlist(checked(shape_of(Objective)), min_length=1, max_length=MAX_OBJECTIVES))
ObjectivesBody = Annotated[
    JsonObject,
    Fields("ObjectivesBody", {**OBJECTIVE, "skill": BodyField("skill", OBJECTIVE["skill"].kind), "objectives": LISTED}),
    Body(openapi_examples=OBJECTIVE_EXAMPLES),
]
ProgressBody = Annotated[
    JsonObject,
    Fields("ProgressBody", fields_of(ProgressReport, without=["objective"])),
    example({"text": "SUCCESS"}),
]
ContextBody = Annotated[
    JsonObject, Fields("ContextBody", fields_of(ContextRequest, without=["actor"])), example({"context": "Default"})
]
Name = Annotated[str, Path(description="An objective's name", examples=["patrol_1"], max_length=200)]
LOCATION: Final[dict[str, Any]] = {
    "Location": {"description": "The objective, if there is one", "schema": {"type": "string"}}
}


@dataclass(frozen=True, slots=True)
class MetacontrollerLine:
    """A metacontroller: its component, its objectives and its context; ``status`` is null, and ``problem`` states why,
    if it does not answer.
    """

    planner: str
    component: str
    status: ObjectivesStatus | None = None
    problem: str = ""


@dataclass(frozen=True, slots=True)
class ObjectiveList:
    """The objectives of all metacontrollers, by planner."""

    metacontrollers: tuple[MetacontrollerLine, ...]


@dataclass(frozen=True, slots=True)
class ContextView:
    """The present context of a metacontroller, and all that it knows."""

    context: str
    contexts: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Asked:
    """The metacontroller that is meant, the caller's name, and whether the answer waits for what is asked for."""

    planner: str
    robot: str
    actor: str
    wait: bool


def asked(
    request: Request,
    planner: Annotated[
        str, Query(description="The metacontroller that is meant; needed only if there are several", max_length=129)
    ] = "",
    robot: OfRobot = "",
    prefer: Annotated[str, Header(description="`respond-async` answers before it is done")] = "",
    x_regraft_actor: ActorHeader = "",
) -> Asked:
    """Return the query and headers of a request that acts; raises Problem."""
    preferences = {preference.strip().lower() for preference in prefer.split(",")}
    return Asked(planner, robot, actor(request, x_regraft_actor), "respond-async" not in preferences)


Acting = Annotated[Asked, Depends(asked)]
OfPlanner = Annotated[str, Query(description="Only those of this metacontroller", max_length=129)]


def routes(metacontrollers: Metacontrollers, prefix: str) -> APIRouter:
    """Return the routes; ``prefix`` is where the API begins."""
    router = APIRouter(tags=["objectives"], route_class=JsonRoute)
    _add_reading(router, metacontrollers)

    @router.post(
        "/objectives",
        status_code=201,
        response_description="The objectives, and what provides them",
        responses={201: {"headers": LOCATION}, **declared(404, 409, 413, 415, 422, 503)},
    )
    def add_objectives(body: ObjectivesBody, by: Acting, response: Response) -> Shown[ObjectivesStatus]:
        """Have skills provided: one objective, or all of a list or none.

        The answer waits until each is provided or has been found impossible for now. One that is impossible now stays.
        """
        wanted = _objectives(body)
        request = built(ObjectivesRequest, wanted, by.actor, by.wait)
        try:
            found = metacontrollers.change(by.planner, by.robot, ADD, request, ObjectivesStatus)
        except Problem as problem:
            raise problem if "objectives" in body else _of_single(problem) from None
        if len(wanted) == 1:
            name = wanted[0].name or wanted[0].skill
            meant = {"planner": by.planner, "robot": by.robot}
            query = urlencode({key: value for key, value in meant.items() if value})
            response.headers["Location"] = f"{prefix}/objectives/{quote(name, safe='')}{'?' if query else ''}{query}"
        return found

    @router.delete(
        "/objectives/{name}",
        response_description="The objectives that are left",
        responses=declared(404, 409, 422, 503),
    )
    def cancel_objective(name: Name, by: Acting) -> Shown[ObjectivesStatus]:
        """End an objective; the answer has those that are left, and waits until its components rest."""
        request = ObjectivesCancellation(name, "", by.actor, by.wait)
        return metacontrollers.change(by.planner, by.robot, CANCEL, request, ObjectivesStatus)

    @router.delete(
        "/objectives", response_description="The objectives that are left", responses=declared(404, 409, 422, 503)
    )
    def cancel_task(
        task: Annotated[str, Query(description="The task whose objectives end", min_length=1, max_length=200)],
        by: Acting,
    ) -> Shown[ObjectivesStatus]:
        """End all objectives of a task; the answer has those that are left, and waits until their components rest."""
        request = ObjectivesCancellation("", task, by.actor, by.wait)
        return metacontrollers.change(by.planner, by.robot, CANCEL, request, ObjectivesStatus)

    @router.post(
        "/objectives/{name}/progress",
        response_description="The objective",
        responses=declared(404, 409, 413, 415, 422, 503),
    )
    def report_progress(name: Name, body: ProgressBody, by: Acting) -> Shown[ObjectiveStatus]:
        """Report a skill's result as `text` or `number`, which its results classify: success and error end it."""
        if len(body) != 1:
            raise _invalid("text", "give either text or number")
        request = built(ProgressReport, name, **body)
        return metacontrollers.change(by.planner, by.robot, REPORT, request, ObjectiveStatus)

    @router.put(
        "/planners/{name}/context",
        response_description="The context",
        responses=declared(404, 409, 413, 415, 422, 503),
    )
    def set_context(
        name: PlannerName, body: ContextBody, request: Request, x_regraft_actor: ActorHeader = ""
    ) -> Shown[ContextStatus]:
        """Set the context in which a metacontroller chooses realizations."""
        wanted = built(ContextRequest, actor=actor(request, x_regraft_actor), **body)
        return metacontrollers.change(name, "", CONTEXT, wanted, ContextStatus)

    return router


def _add_reading(router: APIRouter, metacontrollers: Metacontrollers) -> None:
    @router.get("/objectives", response_description="The objectives", responses=declared(404, 422, 503))
    def list_objectives(planner: OfPlanner = "", robot: OfRobot = "") -> Shown[ObjectiveList]:
        """The objectives of all metacontrollers, of one, or of a robot's; with contexts and realizations that rest."""
        known = metacontrollers.known(robot)
        names = [metacontrollers.meant(planner, robot)] if planner else sorted(known)
        return ObjectiveList(tuple(_line(metacontrollers, name, known[name]) for name in names))

    @router.get("/objectives/{name}", response_description="The objective", responses=declared(404, 422, 503))
    def show_objective(name: Name, planner: OfPlanner = "", robot: OfRobot = "") -> Shown[ObjectivesStatus]:
        """An objective, and behind it those that it requires: states, realizations, qualities, attempts."""
        return metacontrollers.ask(planner, robot, LIST, ObjectivesQuery(name), ObjectivesStatus)

    @router.get(
        "/objectives/{name}/explanation", response_description="The explanation", responses=declared(404, 422, 503)
    )
    def explain_objective(name: Name, planner: OfPlanner = "", robot: OfRobot = "") -> Shown[Explanation]:
        """The reasons for and against each realization in the latest decision, as text and as data."""
        return metacontrollers.ask(planner, robot, EXPLAIN, ExplanationQuery(name), Explanation)

    @router.get("/planners/{name}/context", response_description="The context", responses=declared(404, 422, 503))
    def show_context(name: PlannerName) -> Shown[ContextView]:
        """The context in which a metacontroller chooses realizations, and all contexts that it knows."""
        found = metacontrollers.ask(name, "", LIST, ObjectivesQuery(), ObjectivesStatus)
        return ContextView(found.context, found.contexts)


def _objectives(body: JsonObject) -> tuple[Objective, ...]:
    """Return what a body asks for: one objective, or a list of them; raises Problem."""
    if "objectives" in body:
        others = sorted(body.keys() - {"objectives"})
        if others:
            raise _invalid(others[0], "belongs to a single objective: give either it or objectives")
        return tuple(body["objectives"])
    if "skill" not in body:
        raise _invalid("skill", "is missing: give a skill, or objectives")
    return (built(Objective, **body),)


def _of_single(problem: Problem) -> Problem:
    """Return a refusal with the fields of the only objective, as its body has them."""
    place = "objectives.0."
    own = [replace(each, field=each.field.removeprefix(place)) for each in problem.violations]
    return Problem(problem.kind, problem.detail.removeprefix(place), own, headers=problem.headers)


def _invalid(field: str, problem: str) -> Problem:
    return Problem(INVALID, f"{field}: {problem}", [violation(field, problem)])


def _line(metacontrollers: Metacontrollers, planner: str, component: str) -> MetacontrollerLine:
    try:
        found = metacontrollers.ask_one(planner, LIST, ObjectivesQuery(), ObjectivesStatus, LIST_TIMEOUT)
    except Problem as error:
        return MetacontrollerLine(planner, component, None, error.detail)
    return MetacontrollerLine(planner, component, found)
