"""The protocol of simulated time in step (docs/protocol.md, "Simulated time"). Times are simulated nanoseconds."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from regraft.bus_schema.annotations import Count, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.management.system import SystemNews
from regraft.bus_schema.messages.protocol.control import ResentSample

Frontier = dict[str, dict[str, Count]]
"""Per key and source, the sequence up to which data is to be handled."""


class StepKind(Enum):
    """The work that a member is to do."""

    WELCOME = "welcome"
    MARK = "mark"
    STEP = "step"
    SLOT = "slot"
    REPORT = "report"


@message("regraft/Step")
@dataclass(frozen=True, slots=True)
class Step:
    """Work for one member. ``frontier`` holds what advanced on its inputs; beyond it nothing may be handled.

    ``gone`` names sources that left: what they sent beyond the last frontier is dropped. ``ended`` names members whose
    run has ended, also if another is there by now: what was done for it ends. ``wanted`` (None: unchanged)
    lists the member's output keys that other members read. ``outside`` names sources that are no members, whose
    messages enter in this slot. ``marks`` lists the output keys on which a marker is to be put.

    ``samples`` has, by key, the newest that the source itself has put: they come on the bus, too, perhaps later.
    ``source_reads``, which comes with ``wanted``, has those of the wanted keys that the source itself reads.
    """

    incarnation: Count
    number: Count
    kind: StepKind
    tick: Count
    round: Count
    time: Count
    frontier: Frontier = field(default_factory=dict)
    gone: tuple[str, ...] = ()
    wanted: tuple[str, ...] | None = None
    outside: tuple[str, ...] = ()
    marks: tuple[str, ...] = ()
    ended: tuple[str, ...] = ()
    samples: dict[str, ResentSample] = field(default_factory=dict)
    source_reads: tuple[str, ...] = ()


@message("regraft/Wiring")
@dataclass(frozen=True, slots=True)
class Wiring:
    """The keys that a member reads (true where new data wakes it) and those it writes, with their last sequence.

    ``anew`` names keys that it had stopped reading, and reads again, since it last sent its wiring. ``on_demand`` names
    those that it reads without a subscription: it fetches what it opens.
    """

    inputs: dict[str, bool]
    outputs: dict[str, Count]
    anew: tuple[str, ...] = ()
    on_demand: tuple[str, ...] = ()


@message("regraft/Ack")
@dataclass(frozen=True, slots=True)
class Ack:
    """The end of a step: what was published, when the member wants to be woken, and whether it wants a slot.

    ``wiring`` is sent when it changed. ``touched`` (slots only) names members whose wiring or timing was changed.
    ``news`` is what the member reports of itself, if anything. ``holds_time`` has time stand after this tick.
    ``samples`` has, by key, the newest that it has put for the source: they come on the bus, too, perhaps later.
    """

    member: str
    incarnation: Count
    number: Count
    published: dict[str, Count]
    next_wake: Count | None = None
    wants_slot: bool = False
    wiring: Wiring | None = None
    touched: tuple[str, ...] = ()
    error: str = ""
    news: SystemNews | None = None
    holds_time: bool = False
    samples: dict[str, ResentSample] = field(default_factory=dict)


@message("regraft/Join")
@dataclass(frozen=True, slots=True)
class Join:
    """A component asks to be stepped from now on. ``time`` is the latest simulated time that it has seen."""

    member: str
    incarnation: Count
    epoch: Count
    wiring: Wiring
    next_wake: Count | None
    time: Count
    wants_slot: bool = False


@message("regraft/MarkerAck")
@dataclass(frozen=True, slots=True)
class MarkerAck:
    """A member has received a marker: it is wired to that source on that key, and has handled up to ``sequence``."""

    member: str
    incarnation: Count
    key: str
    source: str
    sequence: Count


@message("regraft/SlotRequest")
@dataclass(frozen=True, slots=True)
class SlotRequest:
    """A member has received something from sources that are no members, and asks for a slot to handle it in."""

    member: str
    incarnation: Count
    outside: tuple[str, ...]


@message("regraft/ClockMember")
@dataclass(frozen=True, slots=True)
class ClockMember:
    """A run that the holder of a slot admits as a member, releases, or lets succeed another."""

    member: str
    incarnation: Count
    term: Count | None = None


@message("regraft/Membership")
@dataclass(frozen=True, slots=True)
class Membership:
    """Whether a run is a member by now: one that has been started has to ask to join first."""

    member: bool


class CauseCode(Enum):
    """Why a run is not repeatable, or why a part of it was restarted; the last three are what hosts report.

    ``left``: a member's run has ended. ``replaced``: a newer run of a member came. ``silent``: no acknowledgement in
    time. ``not_joined``: time began without it. ``unwired``: a connection was not confirmed. ``messages_lost``: a step
    was done without some of its messages. ``schedule_missed``: a scheduled fault was not kept. ``source_restarted``:
    the source of time is another run. ``hung``, ``over_limit``: the host has killed it. ``ended``: it ended by itself,
    or somebody else has killed it.
    """

    LEFT = "left"
    REPLACED = "replaced"
    SILENT = "silent"
    NOT_JOINED = "not_joined"
    UNWIRED = "unwired"
    MESSAGES_LOST = "messages_lost"
    SCHEDULE_MISSED = "schedule_missed"
    SOURCE_RESTARTED = "source_restarted"
    HUNG = "hung"
    OVER_LIMIT = "over_limit"
    ENDED = "ended"


@message("regraft/RunCause")
@dataclass(frozen=True, slots=True)
class RunCause:
    """One cause of a run that is not repeatable: whose, at which simulated time (s), and more for people."""

    code: CauseCode
    component: str
    stamp: Seconds
    text: str = ""


@message("regraft/ClockTime")
@dataclass(frozen=True, slots=True)
class ClockTime:
    """Simulated time for onlookers: tick, time, members, speed against the wall clock, whether the run is repeatable.

    ``tick`` is the number of the tick that ends at ``time``, in ns since the start; it lasts until the next begins.
    ``wall`` is the wall-clock time since the first tick, also after the source has died and was restarted. ``causes``
    are the first causes why the run is not repeatable, in their order.
    """

    tick: Count
    time: Count
    speed: float
    members: tuple[str, ...]
    waiting_for: tuple[str, ...] = ()
    reproducible: bool = True
    dropped: tuple[str, ...] = ()
    finished: bool = False
    wall: Seconds = 0.0
    causes: tuple[RunCause, ...] = ()
