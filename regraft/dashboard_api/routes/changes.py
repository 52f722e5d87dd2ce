"""The routes that change one component: short forms of adaptations."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from starlette.responses import Response

from regraft.bus_schema.errors import BadKey
from regraft.bus_schema.keys import component_name
from regraft.bus_schema.model.adaptation import Move, Outcome, Swap
from regraft.bus_schema.model.lifecycle import Transition
from regraft.bus_schema.suggestions import instead_of
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.outcomes import answer, declared_outcomes
from regraft.dashboard_api.http.adaptation_headers import AdaptationHeaders, adaptation_headers
from regraft.dashboard_api.http.body import json_object, unknown_fields
from regraft.dashboard_api.http.problems import declared, malformed, not_found
from regraft.dashboard_api.http.roles import require_for
from regraft.dashboard_api.routes.adaptations import request_body
from regraft.dashboard_api.routes.reading import read_change, read_reason, request, short_form
from regraft.dashboard_api.routes.status import ComponentName

TRANSITION_SCHEMA = {
    "type": "object",
    "properties": {
        "transition": {"enum": [transition.value for transition in Transition]},
        "reason": {"type": "string", "maxLength": 1000},
    },
    "required": ["transition"],
    "additionalProperties": False,
}
PARAMETERS_SCHEMA = {"type": "object", "description": "New values by parameter; the others keep theirs"}
SWAP_EXAMPLE = {
    "class": "regraft.services.detector.template_detector:TemplateDetector",
    "parameters": {"interval": 1.0},
}
SWAP_SCHEMA = short_form(Swap)
MOVE_SCHEMA = short_form(Move)
PROBLEMS = (404, 409, 412, 413, 415, 422, 429, 503)


def routes(manager: Manager, prefix: str) -> APIRouter:
    """Return the routes; ``prefix`` is where the API begins."""
    router = APIRouter(tags=["components"])

    def change(name: str, plain: dict[str, Any], reason: str, asked: AdaptationHeaders) -> Response:
        try:
            component_name(name)
        except BadKey as error:
            raise not_found(str(error)) from None
        wanted = read_change({**plain, "component": name})
        require_for((wanted,), asked.caller, manager.architecture)
        report = manager.adapt(request((wanted,), reason, asked.revision, asked))
        if report.outcome is Outcome.REJECTED and name not in (known := manager.architecture().components):
            raise not_found(f"there is no component {name!r}; {instead_of(name, known)}")
        return answer(report, prefix, if_match=asked.revision is not None)

    @router.patch(
        "/components/{name}/parameters",
        responses={**declared_outcomes(), **declared(*PROBLEMS)},
        openapi_extra=request_body(PARAMETERS_SCHEMA, {"max_velocity": 0.18}),
    )
    def set_parameters(
        name: ComponentName,
        body: Annotated[dict[str, Any], Depends(json_object)],
        asked: Annotated[AdaptationHeaders, Depends(adaptation_headers)],
        reason: Annotated[str, Query(max_length=1000)] = "",
    ) -> Response:
        """Set several parameters of a component, all or none."""
        plain = {"change": "set_parameters", "parameters": body}
        return change(name, plain, read_reason({"reason": reason}), asked)

    @router.post(
        "/components/{name}/transition",
        responses={**declared_outcomes(), **declared(*PROBLEMS)},
        openapi_extra=request_body(TRANSITION_SCHEMA, {"transition": "deactivate", "reason": "dark"}),
    )
    def change_state(
        name: ComponentName,
        body: Annotated[dict[str, Any], Depends(json_object)],
        asked: Annotated[AdaptationHeaders, Depends(adaptation_headers)],
    ) -> Response:
        """Bring a component to another lifecycle state."""
        wrong = unknown_fields(body, ["transition", "reason"])
        if wrong:
            raise malformed(*wrong)
        plain = {"change": "transition"} | ({"transition": body["transition"]} if "transition" in body else {})
        return change(name, plain, read_reason(body), asked)

    @router.post(
        "/components/{name}/swap",
        responses={**declared_outcomes(), **declared(*PROBLEMS)},
        openapi_extra=request_body(SWAP_SCHEMA, SWAP_EXAMPLE),
    )
    def swap(
        name: ComponentName,
        body: Annotated[dict[str, Any], Depends(json_object)],
        asked: Annotated[AdaptationHeaders, Depends(adaptation_headers)],
    ) -> Response:
        """Have another class go on in a component's place, or the same one configured otherwise."""
        return change(name, _plain("swap", body, SWAP_SCHEMA), read_reason(body), asked)

    @router.post(
        "/components/{name}/move",
        responses={**declared_outcomes(), **declared(*PROBLEMS)},
        openapi_extra=request_body(MOVE_SCHEMA, {"host": "second", "reason": "more room to compute"}),
    )
    def move(
        name: ComponentName,
        body: Annotated[dict[str, Any], Depends(json_object)],
        asked: Annotated[AdaptationHeaders, Depends(adaptation_headers)],
    ) -> Response:
        """Have a component go on at another host."""
        return change(name, _plain("move", body, MOVE_SCHEMA), read_reason(body), asked)

    return router


def _plain(kind: str, body: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    """Return the change that a body describes, as plain data; raises Problem for what it must not have."""
    wrong = unknown_fields(body, list(schema["properties"]))
    if wrong:
        raise malformed(*wrong)
    return {"change": kind} | {field: value for field, value in body.items() if field != "reason"}
