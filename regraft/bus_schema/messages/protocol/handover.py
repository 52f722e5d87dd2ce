"""The messages between two runs of a component, one of which takes over from the other (docs/protocol.md, "State")."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from regraft.bus_schema.annotations import ClassPath, Count, PlainValue, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.bus_schema.messages.protocol.requests import Reply, Request
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.lifecycle import State


class HandoverStep(Enum):
    """The request to a run. ``prepare`` and ``pull`` come from its successor, the others from the manager."""

    READ = "read"
    PREPARE = "prepare"
    TAKE_OVER = "take_over"
    PULL = "pull"
    PROMOTE = "promote"
    RESUME = "resume"
    RETIRE = "retire"


class Role(Enum):
    """Whether a run speaks for its component: alone ``live`` does, ``waiting`` not yet, ``frozen`` no more."""

    WAITING = "waiting"
    LIVE = "live"
    FROZEN = "frozen"


@message("regraft/Place")
@dataclass(frozen=True, slots=True)
class Place:
    """How far a source's numbering on a key has come: an epoch and a sequence in it."""

    epoch: Count
    sequence: Count


@message("regraft/Handover")
@dataclass(frozen=True, slots=True)
class Handover:
    """One step of a hand-over.

    ``peer`` is the incarnation of the other run: who asks (prepare, pull), or the successor that is given up (resume).
    ``incarnation`` is what a run that resumes is called from now on, 0 to keep its own. ``first`` is, per key and
    source, the first sample that the successor holds itself (pull). It may do without the state (``with_state``, pull).
    """

    step: HandoverStep
    peer: Count = 0
    incarnation: Count = 0
    first: dict[str, dict[str, Place]] = field(default_factory=dict)
    term: Count | None = None
    revision: Count | None = None
    with_state: bool = True


@message("regraft/HandoverOffer")
@dataclass(frozen=True, slots=True)
class HandoverOffer:
    """The state that an incumbent would hand over: the reply to ``prepare``.

    ``handler_timeout`` is how long it may take to notice a ``pull``, and to release what it holds for itself.
    """

    component: str
    incarnation: Count
    cls: ClassPath
    epoch: Count
    state: State
    stateful: bool
    version: Count
    handler_timeout: Seconds
    parameters: dict[str, PlainValue]
    writes: dict[str, str]
    now: Count = 0
    tick: Count | None = None


@message("regraft/HeldSample")
@dataclass(frozen=True, slots=True)
class HeldSample:
    """A sample as it came. Without an encoding it only names, by its attachment, one that the successor holds."""

    key: str
    payload: bytes
    attachment: bytes
    encoding: str


@message("regraft/StreamPlace")
@dataclass(frozen=True, slots=True)
class StreamPlace:
    """How far one source on one key was handled; None if nothing was. ``wired`` as in docs/protocol.md, "Sequences".

    ``since`` is the first sequence of this incarnation, if it continues with the numbering of another, else 0.
    """

    key: str
    source: str
    epoch: Count
    incarnation: Count
    handled: Count | None
    wired: bool
    since: Count = 0


@message("regraft/ServedClient")
@dataclass(frozen=True, slots=True)
class ServedClient:
    """A service's memory of a client: its last replies, and the requests under way (of an action: its goals).

    ``answered`` are numbers answered before those, up to ``forgotten`` anything may have been. ``places`` is the place
    of each goal under way among those of all clients, the oldest first.
    """

    service: str
    client: str
    forgotten: Count
    answered: tuple[Count, ...]
    replies: tuple[Reply, ...]
    under_way: tuple[Request, ...]
    places: tuple[Count, ...] = ()


@message("regraft/HandedOver")
@dataclass(frozen=True, slots=True)
class HandedOver:
    """All that a successor needs to continue where the incumbent froze: the reply to ``pull``.

    ``frozen_at`` is nanoseconds of the component's clock; ``writes`` the last sequence of every key ever written in
    ``epoch``; ``unhandled`` what had come but was not handled, without what the successor holds itself; ``inputs``
    per port its newest message, then what it keeps; ``asked`` the number of the last request made; ``reads`` every key
    read; ``timers`` when each is due, in nanoseconds. ``advanced`` (in step only) is what it has published and not yet
    acknowledged. ``requirements`` are the latest reports of them; ``goals`` the numbers of goals, by service, that it
    has given others and that end with it.
    """

    snapshot: Snapshot
    frozen_at: Count
    state: State
    epoch: Count
    parameters: dict[str, PlainValue]
    writes: dict[str, Count]
    reads: tuple[str, ...]
    streams: tuple[StreamPlace, ...]
    unhandled: tuple[HeldSample, ...]
    inputs: dict[str, tuple[HeldSample, ...]]
    clients: tuple[ServedClient, ...]
    asked: Count
    timers: dict[str, Count]
    advanced: dict[str, Count] = field(default_factory=dict)
    requirements: tuple[Quality, ...] = ()
    goals: dict[str, tuple[Count, ...]] = field(default_factory=dict)
