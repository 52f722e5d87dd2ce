"""From the outcome of an adaptation to an answer."""

from __future__ import annotations

from typing import Any
from urllib.parse import quote

from fastapi import Response

from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome
from regraft.dashboard_api.http.bus_types import Shown
from regraft.dashboard_api.http.problems import CANCELLED, REJECTED, ROLLED_BACK, STALE, STUCK, Kind, Problem

KINDS: dict[Outcome, Kind] = {
    Outcome.REJECTED: REJECTED,
    Outcome.ROLLED_BACK: ROLLED_BACK,
    Outcome.CANCELLED: CANCELLED,
    Outcome.STUCK: STUCK,
}


def answer(report: AdaptationReport, response: Response, prefix: str, *, if_match: bool = False) -> AdaptationReport:
    """Return the answer for a report: 200 applied, 202 under way; raises Problem for any other outcome.

    A stale revision is a failed precondition (412) where the caller gave it as ``If-Match``.
    """
    kind = KINDS.get(report.outcome)
    if report.request.dry_run and kind is not REJECTED:
        return report
    if kind is None:
        if report.outcome in (Outcome.PENDING, Outcome.CONFIRMING):
            response.status_code = 202
        if report.id:
            response.headers["Location"] = f"{prefix}/adaptations/{quote(report.id, safe='')}"
        return report
    if kind is REJECTED and if_match and any(v.field == "revision" for v in report.violations):
        kind = STALE
    raise Problem(kind, _detail(report), report.violations, report=report)


def _detail(report: AdaptationReport) -> str:
    if report.violations:
        return "; ".join(map(str, report.violations))
    return report.error or f"the adaptation ended as {report.outcome.value}"


def declared_outcomes() -> dict[int | str, dict[str, Any]]:
    """Return, for OpenAPI, the good answers of a route that adapts."""
    location = {"Location": {"description": "The adaptation's line in the journal", "schema": {"type": "string"}}}
    return {
        200: {"description": "Applied; or, for a dry run, the plan", "headers": location},
        202: {"description": "Accepted and under way", "headers": location, "model": Shown[AdaptationReport]},
    }
