"""Requests to services and actions, and their replies: ordinary sequenced messages on ``service/NAME/...``.

A client numbers its requests; a service answers each once, and repeats its answer when it is asked again with the
same number. A goal is a request that is first accepted, then gives feedback, then a result.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from bus_schema.annotations import Bounds, Count, PlainValue, Seconds, Told
from bus_schema.keys import client_name
from bus_schema.registry import message


class Verb(Enum):
    """What a client wants: a call's reply, a goal's pursuit, a goal's end, or a goal's result (again)."""

    CALL = "call"
    GOAL = "goal"
    CANCEL = "cancel"
    RESULT = "result"


class Answer(Enum):
    """What a reply is."""

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
        """Refuse a client's name that cannot be part of the key of its replies."""
        client_name(self.client)


@message("regraft/Reply")
@dataclass(frozen=True, slots=True)
class Reply:
    """Answer to request ``number``; ``body`` is the typed part, ``error`` says why it was refused or failed.

    ``retry_after`` says when what was refused may be asked for again, under a new number; None if that is of no use.
    ``bad_request`` says that the request itself was wrong: it names what is not there, or does not fit.
    """

    number: Count
    answer: Answer
    body: PlainValue = None
    error: Told = ""
    retry_after: Annotated[Seconds, Bounds(minimum=0.0)] | None = None
    bad_request: bool = False
