"""The routes that change one component: short forms of adaptations."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from regraft.bus_schema.errors import BadKey
from regraft.bus_schema.keys import component_name
from regraft.bus_schema.model.adaptation import AdaptationReport, ChangeState, Move, Outcome, SetParameters, Swap
from regraft.bus_schema.suggestions import instead_of
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.outcomes import answer, declared_outcomes
from regraft.dashboard_api.http.adaptation_headers import AdaptationHeaders, Asked
from regraft.dashboard_api.http.body import JsonRoute
from regraft.dashboard_api.http.bus_types import JsonObject, Shown
from regraft.dashboard_api.http.problems import declared, not_found
from regraft.dashboard_api.http.roles import require_for
from regraft.dashboard_api.routes.bodies import MoveBody, ParametersBody, SwapBody, TransitionBody
from regraft.dashboard_api.routes.status import ComponentName

ABOUT = ("reason", "confirm", "watch")
"""The fields of a body that are about the adaptation, not about its change."""
ANSWERS = {**declared_outcomes(), **declared(404, 409, 412, 413, 415, 422, 429, 503)}


def routes(manager: Manager, prefix: str) -> APIRouter:
    """Return the routes; ``prefix`` is where the API begins."""
    router = APIRouter(tags=["components"], route_class=JsonRoute)

    def change(
        kind: type, name: str, body: JsonObject, asked: AdaptationHeaders, response: Response
    ) -> AdaptationReport:
        try:
            component_name(name)
        except BadKey as error:
            raise not_found(str(error)) from None
        about = {name: body.pop(name) for name in ABOUT if name in body}
        wanted = kind(name, **body)
        require_for((wanted,), asked.caller, manager.architecture)
        report = manager.adapt(asked.request((wanted,), **about))
        if report.outcome is Outcome.REJECTED and name not in (known := manager.architecture().components):
            raise not_found(f"there is no component {name!r}; {instead_of(name, known)}")
        return answer(report, response, prefix, if_match=asked.revision is not None)

    @router.patch("/components/{name}/parameters", responses=ANSWERS)
    def set_parameters(
        name: ComponentName,
        body: ParametersBody,
        asked: Asked,
        response: Response,
        reason: Annotated[str, Query(max_length=1000)] = "",
    ) -> Shown[AdaptationReport]:
        """Set several parameters of a component, all or none."""
        return change(SetParameters, name, {"parameters": body, "reason": reason}, asked, response)

    @router.post("/components/{name}/transition", responses=ANSWERS)
    def change_state(
        name: ComponentName, body: TransitionBody, asked: Asked, response: Response
    ) -> Shown[AdaptationReport]:
        """Bring a component to another lifecycle state."""
        return change(ChangeState, name, body, asked, response)

    @router.post("/components/{name}/swap", responses=ANSWERS)
    def swap(name: ComponentName, body: SwapBody, asked: Asked, response: Response) -> Shown[AdaptationReport]:
        """Put another class in a component's place, or the same one configured otherwise."""
        return change(Swap, name, body, asked, response)

    @router.post("/components/{name}/move", responses=ANSWERS)
    def move(name: ComponentName, body: MoveBody, asked: Asked, response: Response) -> Shown[AdaptationReport]:
        """Continue a component at another host."""
        return change(Move, name, body, asked, response)

    return router
