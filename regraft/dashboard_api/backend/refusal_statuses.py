"""From the refusal of a service to a problem: by its code, with any text."""

from __future__ import annotations

from regraft import CallFailed
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.dashboard_api.http.problems import (
    BUSY,
    CONFLICT,
    FAILED,
    INVALID,
    KEY_REUSED,
    MALFORMED,
    NO_ANSWER,
    NOT_ACTIVE,
    NOT_FOUND,
    QUEUE_FULL,
    REFUSED,
    STARTING,
    THROTTLED,
    UNAVAILABLE,
    Kind,
    Problem,
    retry_after,
    violation,
)

KINDS: dict[RefusalCode, Kind] = {
    RefusalCode.REFUSED: REFUSED,
    RefusalCode.MALFORMED: MALFORMED,
    RefusalCode.INVALID: INVALID,
    RefusalCode.NOT_FOUND: NOT_FOUND,
    RefusalCode.CONFLICT: CONFLICT,
    RefusalCode.KEY_REUSED: KEY_REUSED,
    RefusalCode.THROTTLED: THROTTLED,
    RefusalCode.QUEUE_FULL: QUEUE_FULL,
    RefusalCode.BUSY: BUSY,
    RefusalCode.STARTING: STARTING,
    RefusalCode.NOT_ACTIVE: NOT_ACTIVE,
    RefusalCode.UNAVAILABLE: UNAVAILABLE,
}


def problem_of(error: CallFailed) -> Problem:
    """Return the problem of a request that a service refused, failed or did not answer."""
    if error.code is not None:
        kind = KINDS[error.code]
    else:
        kind = FAILED if error.answer is Answer.FAILED else NO_ANSWER
    text = error.why if error.answer is Answer.REFUSED else str(error)
    violations = (violation(error.field, error.problem),) if error.field else ()
    return Problem(kind, text, violations, headers=retry_after(kind, error.retry_after))
