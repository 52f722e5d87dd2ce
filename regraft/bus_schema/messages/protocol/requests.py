"""Requests to services and actions, and their replies: ordinary sequenced messages on ``service/NAME/...``.

A client numbers its requests; a service answers each once, and repeats its answer when it is asked again with the
same number. A goal is a request that is first accepted, then gives feedback, then a result.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Count, PlainValue, Seconds, Told, ToldBriefly
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.keys import client_name
from regraft.bus_schema.messages.protocol.refusal_codes import RefusalCode


class Verb(Enum):
    """The kind of a request: a call's reply, a goal's pursuit, a goal's end, or a goal's result (again)."""

    CALL = "call"
    GOAL = "goal"
    CANCEL = "cancel"
    RESULT = "result"


class Answer(Enum):
    """The kind of a reply."""

    RESULT = "result"
    ACCEPTED = "accepted"
    FEEDBACK = "feedback"
    CANCELLED = "cancelled"
    REFUSED = "refused"
    FAILED = "failed"


@message("regraft/Request")
@dataclass(frozen=True, slots=True)
class Request:
    """Request ``number`` of ``client`` (a name and incarnation, unique in the system); ``body`` is the typed part.

    ``patience`` is how long the client will wait. For ``cancel`` and ``result``, ``number`` is the goal's. A goal ends
    with the run of its client unless it ``outlives`` it.
    """

    client: str
    number: Count
    verb: Verb
    body: PlainValue = None
    patience: Annotated[Seconds, Bounds(minimum=0.0)] = 5.0
    outlives: bool = False

    def __post_init__(self) -> None:
        client_name(self.client)


@message("regraft/Reply")
@dataclass(frozen=True, slots=True)
class Reply:
    """Answer to request ``number``; ``body`` is the typed part, ``error`` states why it was refused or failed.

    A refusal has a ``code``. ``field`` is the path of the request's field at fault, empty if there is none.
    ``retry_after`` is when a refused request may be sent again, under a new number; None if that is of no use.
    """

    number: Count
    answer: Answer
    body: PlainValue = None
    error: Told = ""
    retry_after: Annotated[Seconds, Bounds(minimum=0.0)] | None = None
    code: RefusalCode | None = None
    field: ToldBriefly = ""
