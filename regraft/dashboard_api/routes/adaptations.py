"""The routes of adaptations and of their journal."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Response

from regraft.bus_schema.messages.management.manager import JournalRequest
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome
from regraft.dashboard_api.backend.manager import Manager
from regraft.dashboard_api.backend.outcomes import answer, declared_outcomes
from regraft.dashboard_api.backend.views import JournalView
from regraft.dashboard_api.http.adaptation_headers import Asked
from regraft.dashboard_api.http.body import JsonRoute
from regraft.dashboard_api.http.bus_types import Shown
from regraft.dashboard_api.http.problems import CONFLICT, Problem, declared
from regraft.dashboard_api.http.roles import require_for
from regraft.dashboard_api.routes.bodies import AdaptationBody, NoBody, UndoBody

Id = Annotated[str, Path(alias="id", description="An adaptation's id", examples=["7"])]


def routes(manager: Manager, prefix: str) -> APIRouter:
    """Return the routes; ``prefix`` is where the API begins."""
    router = APIRouter(tags=["adaptations"], route_class=JsonRoute)

    @router.get("/adaptations", response_description="A page of the journal", responses=declared(404, 422, 503))
    def list_adaptations(
        before: Annotated[str, Query(max_length=200, description="Only those older than this one")] = "",
        limit: Annotated[int, Query(ge=1, le=500)] = 50,
    ) -> Shown[JournalView]:
        """The journal, newest first, and the adaptations that wait for their turn."""
        page = manager.journal(JournalRequest(before=before, limit=limit))
        following = page.entries[-1].id if page.more and page.entries else None
        return JournalView(page.entries, following, page.faults, page.waiting)

    @router.get("/adaptations/{id}", response_description="The adaptation", responses=declared(404, 422, 503))
    def show_adaptation(adaptation: Id) -> Shown[AdaptationReport]:
        """One line of the journal: who, why, each step, what became of it."""
        return manager.entry(adaptation)

    @router.post("/adaptations", responses={**declared_outcomes(), **declared(409, 412, 413, 415, 422, 429, 503)})
    def adapt(body: AdaptationBody, asked: Asked, response: Response) -> Shown[AdaptationReport]:
        """Carry out a list of changes as one transaction: all of it happens or none of it.

        The answer waits for the outcome. A rejected adaptation has touched nothing; one that failed was undone. With
        `confirm` it is watched for so many seconds before it is final, and undone if it does not hold.
        """
        wanted = asked.request(**{**body, "changes": tuple(body["changes"])})
        require_for(wanted.changes, asked.caller, manager.architecture)
        return answer(manager.adapt(wanted), response, prefix, if_match=asked.revision is not None)

    @router.post(
        "/adaptations/{id}/undo",
        responses={**declared_outcomes(), **declared(404, 409, 412, 413, 415, 422, 429, 503)},
    )
    def undo(adaptation: Id, body: UndoBody, asked: Asked, response: Response) -> Shown[AdaptationReport]:
        """Undo an applied adaptation by a new one, under the headers of any adaptation.

        The same key undoes once: a repeated request gets the answer of the first.
        """
        return answer(manager.undo(asked.undo(adaptation, body)), response, prefix, if_match=asked.revision is not None)

    @router.post(
        "/adaptations/{id}/confirm",
        responses={**declared_outcomes(), **declared(404, 409, 413, 415, 422, 429, 503)},
    )
    def confirm(adaptation: Id, body: NoBody, response: Response) -> Shown[AdaptationReport]:
        """Make an adaptation that is being confirmed final at once."""
        return answer(manager.confirm(adaptation), response, prefix)

    @router.delete("/adaptations/{id}", responses={**declared_outcomes(), **declared(404, 409, 422, 429, 503)})
    def cancel(adaptation: Id, response: Response) -> Shown[AdaptationReport]:
        """Cancel an adaptation that waits, is under way or is being confirmed: what it did is undone."""
        report = manager.cancel(adaptation)
        if report.outcome not in (Outcome.CANCELLED, Outcome.PENDING):
            raise Problem(CONFLICT, f"adaptation {adaptation!r} has ended as {report.outcome.value}", report=report)
        response.status_code = 200 if report.outcome is Outcome.CANCELLED else 202
        return report

    return router
