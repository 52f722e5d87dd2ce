"""How one attempt to adapt ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from regraft import CallFailed
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome

APPLIED: Final = Outcome.APPLIED.value
STATE_LOST: Final = Outcome.APPLIED_STATE_LOST.value
REJECTED: Final = Outcome.REJECTED.value
ROLLED_BACK: Final = Outcome.ROLLED_BACK.value
STUCK: Final = Outcome.STUCK.value
UNCHANGED: Final = "unchanged"
"""The result when the wanted values are in force already: no request was made."""
NO_ANSWER: Final = "no_answer"
"""Nobody answered in time; what was asked for may still happen."""

OUTCOMES: Final = (APPLIED, STATE_LOST, UNCHANGED, REJECTED, ROLLED_BACK, Outcome.CANCELLED.value, STUCK, NO_ANSWER)
"""The values of the port ``outcome``."""

POLICY_PORTS: Final = {
    REJECTED: "on_rejected",
    ROLLED_BACK: "on_rolled_back",
    Outcome.CANCELLED.value: "on_rolled_back",
    STUCK: "on_stuck",
    NO_ANSWER: "on_no_answer",
}
"""The port that decides what follows, for each outcome but the good ones."""


@dataclass(frozen=True, slots=True)
class Result:
    """The outcome as one of ``OUTCOMES``, the reason if it is not a good one, and any report.

    ``choice`` is a planner's, None if no planner was asked.
    """

    outcome: str
    reason: str = ""
    report: AdaptationReport | None = None
    choice: Mapping[str, PlainValue] | None = None

    @property
    def applied(self) -> bool:
        """Whether the system was changed as wanted."""
        return self.outcome in (APPLIED, STATE_LOST)

    @property
    def good(self) -> bool:
        """Whether the system is as wanted."""
        return self.applied or self.outcome == UNCHANGED


def reported(report: AdaptationReport) -> Result:
    """Return what a manager's report means."""
    if report.outcome is Outcome.PENDING:
        return Result(NO_ANSWER, "the adaptation has not ended yet", report)
    why = "; ".join(filter(None, (report.error, *map(str, report.violations))))
    result = Result(report.outcome.value, why, report)
    return result if result.good or why else Result(result.outcome, "no reason given", report)


def refused(error: CallFailed) -> Result:
    """Return what a missing answer means; who refuses to act has touched nothing."""
    return Result(REJECTED if error.answer is Answer.REFUSED else NO_ANSWER, str(error))
