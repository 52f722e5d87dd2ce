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


class RefusalCode(Enum):
    """Why a request was refused, for programs: the text next to it is for people, and may change."""

    REFUSED = "refused"
    """For a reason of the service's own."""
    MALFORMED = "malformed"
    """The request has not the right form, or a value out of its bounds."""
    INVALID = "invalid"
    """It has the right form, but what it holds cannot be used, such as a tree that cannot be built."""
    NOT_FOUND = "not_found"
    """It names something that does not exist."""
    CONFLICT = "conflict"
    """It is not possible in the current state of what it is about."""
    KEY_REUSED = "key_reused"
    """Its idempotency key belongs to another request."""
    THROTTLED = "throttled"
    """Its source asks too often."""
    QUEUE_FULL = "queue_full"
    """Too many requests wait already."""
    BUSY = "busy"
    """The action pursues as many goals as it does at once."""
    STARTING = "starting"
    """The service has not started yet."""
    NOT_ACTIVE = "not_active"
    """Its component serves only while active."""
    UNAVAILABLE = "unavailable"
    """Something that the service needs is missing now."""


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
