"""The routes of the planners: which there are, and what they would change or have changed."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Final

from fastapi import APIRouter, Path, Request

from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.model.robots.planners import DESCRIBE, PROPOSE, planner_service
from regraft.bus_schema.suggestions import instead_of
from regraft.dashboard_api.backend.manager import Manager, Services
from regraft.dashboard_api.backend.planners import planners
from regraft.dashboard_api.http.adaptation_headers import ActorHeader, actor
from regraft.dashboard_api.http.body import JsonRoute, built
from regraft.dashboard_api.http.bus_types import Fields, JsonObject, Shown, fields_of
from regraft.dashboard_api.http.problems import (
    NO_ANSWER,
    QUEUE_FULL,
    Problem,
    declared,
    not_found,
    unavailable,
)
from regraft.dashboard_api.routes.bodies import example
from regraft.dashboard_api.routes.status import OfRobot

DESCRIBE_TIMEOUT: Final = 1.0
"""Seconds that the list of planners waits for each of them."""
MAX_WAITING: Final = 16
"""Proposals that are being waited for at the same time; every one of them holds a thread."""
PROPOSAL_EXAMPLE: Final = {
    "task": "drive",
    "reason": "find the best speed",
    "inputs": {
        "strategy": "ucb1",
        "options": [{"component": "navigator", "parameter": "max_velocity", "values": [0.1, 0.18, 0.26]}],
        "settle": 1.0,
    },
}
ProposalBody = Annotated[
    JsonObject,
    Fields("ProposalBody", fields_of(ProposalRequest, without=["actor"])),
    example(PROPOSAL_EXAMPLE),
]

Name = Annotated[str, Path(description="A planner's name", examples=["bandits"])]


@dataclass(frozen=True, slots=True)
class PlannerLine:
    """A planner: the component that it is; ``description`` is null, and ``problem`` states why, if it does not
    answer.
    """

    planner: str
    component: str
    description: PlannerDescription | None = None
    problem: str = ""


@dataclass(frozen=True, slots=True)
class PlannerList:
    """All planners of the system, by name."""

    planners: tuple[PlannerLine, ...]


def routes(services: Services, manager: Manager) -> APIRouter:
    """Return the routes."""
    router = APIRouter(tags=["planners"], route_class=JsonRoute)
    waiting = threading.BoundedSemaphore(MAX_WAITING)

    @router.get("/planners", response_description="The planners", responses=declared(404, 422, 503))
    def list_planners(robot: OfRobot = "") -> Shown[PlannerList]:
        """The planners, all or a robot's: their strategies, and the JSON Schemas of knobs and inputs."""
        found = _planners(manager, robot)
        return PlannerList(tuple(_line(services, name, found[name]) for name in sorted(found)))

    @router.post(
        "/planners/{name}/propose",
        response_description="The proposal",
        responses=declared(404, 413, 415, 422, 503),
    )
    def propose(request: Request, name: Name, body: ProposalBody, x_regraft_actor: ActorHeader = "") -> Shown[Proposal]:
        """Ask a planner for an adaptation, and have it carried out unless ``apply`` is false.

        The answer waits for the outcome, which is in the proposal's report; also that of one that was rejected.
        """
        asked = built(ProposalRequest, actor=actor(request, x_regraft_actor), **body)
        found = _planners(manager)
        if name not in found:
            found = _planners(manager, current=True)
        if name not in found:
            raise not_found(f"there is no planner {name!r}; {instead_of(name, found)}")
        if not waiting.acquire(blocking=False):
            raise unavailable(f"{MAX_WAITING} requests are waiting for proposals already", QUEUE_FULL)
        try:
            return _proposed(services, name, asked)
        finally:
            waiting.release()

    return router


def _proposed(services: Services, name: str, asked: ProposalRequest) -> Proposal:
    try:
        return services.ask(planner_service(name, PROPOSE), asked, Proposal, services.adaptation_within)
    except Problem as problem:
        if problem.kind is NO_ANSWER and asked.apply:
            more = "; what was asked for may still happen: see GET /adaptations"
            raise unavailable(problem.detail + more, NO_ANSWER) from None
        raise


def _planners(manager: Manager, robot: str = "", *, current: bool = False) -> Mapping[str, str]:
    """Return the components that are planners, by the names of the planners; raises Problem."""
    return planners(manager, PROPOSE, robot, current=current)


def _line(services: Services, name: str, component: str) -> PlannerLine:
    try:
        service = planner_service(name, DESCRIBE)
        return PlannerLine(name, component, services.ask(service, PlannerQuery(), PlannerDescription, DESCRIBE_TIMEOUT))
    except Problem as error:
        return PlannerLine(name, component, None, error.detail)
