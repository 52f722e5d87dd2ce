"""Exceptions that a component's author raises and catches."""

from __future__ import annotations

from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode
from regraft.bus_schema.messages.protocol.requests import Answer, Reply


class RequestRefused(Exception):
    """Raise it in a service or action to refuse a request; the client gets the text, and the code to act on.

    ``field`` is the path of the request's field at fault, such as ``goal.frame``. ``retry_after`` is the number of
    seconds after which the same request may be accepted; None if it will not be.
    """

    def __init__(
        self,
        why: str = "",
        code: RefusalCode = RefusalCode.REFUSED,
        *,
        field: str = "",
        retry_after: float | None = None,
    ) -> None:
        self.why = why
        self.code = code
        self.field = field
        self.retry_after = retry_after
        super().__init__(f"{field}: {why}" if field else why)

    @classmethod
    def malformed(cls, error: BadMessage) -> RequestRefused:
        """Return the refusal of a request with a value that does not fit."""
        return cls(error.why, RefusalCode.MALFORMED, field=".".join(error.where))


class CallFailed(Exception):
    """A request got no good reply: it was refused, failed, or timed out; the text states which.

    Attributes:
        service: the service or action.
        answer: what the reply is; ``accepted`` for a goal that was lost after that, None without a reply.
        why: the reason, for people; it begins with the field at fault.
        problem: the reason without the field.
        code: the reason of a refusal, for programs; None otherwise.
        field: the path of the request's field at fault, empty if there is none.
        retry_after: seconds after which a refused request may be accepted; None if it will not be, or is not known.
    """

    def __init__(
        self,
        service: str,
        answer: Answer | None,
        why: str,
        *,
        code: RefusalCode | None = None,
        field: str = "",
        retry_after: float | None = None,
    ) -> None:
        self.service = service
        self.answer = answer
        self.problem = why
        self.why = f"{field}: {why}" if field else why
        self.code = code
        self.field = field
        self.retry_after = retry_after
        super().__init__(f"{service}: {self.why}")

    @classmethod
    def by(cls, service: str, reply: Reply) -> CallFailed:
        """Return what a reply means that is no result."""
        code = (reply.code or RefusalCode.REFUSED) if reply.answer is Answer.REFUSED else None
        why = reply.error or reply.answer.value
        return cls(service, reply.answer, why, code=code, field=reply.field, retry_after=reply.retry_after)

    @property
    def is_bad_request(self) -> bool:
        """Whether the request itself is at fault: it holds what cannot be used, or names what does not exist."""
        return self.code in (RefusalCode.MALFORMED, RefusalCode.INVALID, RefusalCode.NOT_FOUND)


class NotActive(RuntimeError):
    """Only active components publish."""
