"""The routes of adaptations and of their journal."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path, Query, Request
from starlette.responses import Response

from regraft.bus_schema.messages.manager import JournalRequest, UndoAdaptation
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.outcomes import answer, declared_outcomes
from regraft.dashboard_api.backend.views import JournalView
from regraft.dashboard_api.http.adaptation_headers import (
    ActorHeader,
    AdaptationHeaders,
    DryRun,
    actor,
    adaptation_headers,
)
from regraft.dashboard_api.http.body import json_object, optional_json_object, unknown_fields
from regraft.dashboard_api.http.json_replies import reply, shown
from regraft.dashboard_api.http.problems import CONFLICT, Problem, declared, malformed
from regraft.dashboard_api.http.roles import require_for
from regraft.dashboard_api.routes.reading import (
    ADAPTATION_EXAMPLES,
    Examples,
    adaptation_schema,
    read_adaptation,
    read_reason,
    reason_schema,
)

Id = Annotated[str, Path(alias="id", description="An adaptation's id", examples=["7"])]


def routes(manager: Manager, prefix: str) -> APIRouter:
    """Return the routes; ``prefix`` is where the API begins."""
    router = APIRouter(tags=["adaptations"])

    @router.get("/adaptations", responses={**shown(JournalView, "A page of the journal"), **declared(404, 422, 503)})
    def list_adaptations(
        before: Annotated[str, Query(max_length=200, description="Only those older than this one")] = "",
        limit: Annotated[int, Query(ge=1, le=500)] = 50,
    ) -> Response:
        """The journal, newest first."""
        page = manager.journal(JournalRequest(before=before, limit=limit))
        return reply(JournalView(page.entries, page.entries[-1].id if page.more and page.entries else None))

    @router.get(
        "/adaptations/{id}",
        responses={**shown(AdaptationReport, "The adaptation"), **declared(404, 422, 503)},
    )
    def show_adaptation(adaptation: Id) -> Response:
        """One line of the journal: who, why, each step, what became of it."""
        return reply(manager.entry(adaptation))

    @router.post(
        "/adaptations",
        responses={**declared_outcomes(), **declared(409, 412, 413, 415, 422, 429, 503)},
        openapi_extra=request_body(adaptation_schema(), ADAPTATION_EXAMPLES),
    )
    def adapt(
        body: Annotated[dict[str, Any], Depends(json_object)],
        asked: Annotated[AdaptationHeaders, Depends(adaptation_headers)],
    ) -> Response:
        """Carry out a list of changes as one transaction: all of it happens or none of it.

        The answer waits for the outcome. A rejected adaptation has touched nothing; one that failed was undone. With
        `confirm` it is watched for so many seconds before it is final, and undone if it does not hold.
        """
        wanted = read_adaptation(body, asked)
        require_for(wanted.changes, asked.caller, manager.architecture)
        report = manager.adapt(wanted)
        return answer(report, prefix, if_match=asked.revision is not None)

    @router.post(
        "/adaptations/{id}/undo",
        responses={**declared_outcomes(), **declared(404, 409, 413, 415, 422, 429, 503)},
        openapi_extra=request_body(reason_schema(), {"reason": "it was better before"}, required=False),
    )
    def undo(
        request: Request,
        adaptation: Id,
        body: Annotated[dict[str, Any], Depends(optional_json_object)],
        dry_run: DryRun = False,
        x_regraft_actor: ActorHeader = None,
    ) -> Response:
        """Undo an applied adaptation by a new one."""
        wrong = unknown_fields(body, ["reason"])
        if wrong:
            raise malformed(*wrong)
        who = actor(request, x_regraft_actor)
        return answer(manager.undo(UndoAdaptation(adaptation, who, read_reason(body), dry_run)), prefix)

    @router.post(
        "/adaptations/{id}/confirm",
        responses={**declared_outcomes(), **declared(404, 409, 413, 415, 422, 429, 503)},
        openapi_extra=request_body({"type": "object", "additionalProperties": False}, {}, required=False),
    )
    def confirm(adaptation: Id, body: Annotated[dict[str, Any], Depends(optional_json_object)]) -> Response:
        """Make an adaptation that is being confirmed final at once."""
        wrong = unknown_fields(body, [])
        if wrong:
            raise malformed(*wrong)
        return answer(manager.confirm(adaptation), prefix)

    @router.delete("/adaptations/{id}", responses={**declared_outcomes(), **declared(404, 409, 422, 429, 503)})
    def cancel(adaptation: Id) -> Response:
        """Cancel an adaptation that waits, is under way or is being confirmed: what it did is undone."""
        report = manager.cancel(adaptation)
        if report.outcome in (Outcome.CANCELLED, Outcome.PENDING):
            return reply(report, 200 if report.outcome is Outcome.CANCELLED else 202)
        raise Problem(CONFLICT, f"adaptation {adaptation!r} has ended as {report.outcome.value}", report=report)

    return router


def request_body(schema: dict[str, Any], example: Any, *, required: bool = True) -> dict[str, Any]:
    """Return what OpenAPI says of a route's body."""
    shown = {"examples": example.by_name} if isinstance(example, Examples) else {"example": example}
    content = {"application/json": {"schema": schema, **shown}}
    return {"requestBody": {"required": required, "content": content}}
