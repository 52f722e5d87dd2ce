"""Control queries to a component, and what it replies. Those that change something carry the manager's term."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated

from regraft.bus_schema.annotations import Connections, Count, PlainValue, Seconds, Text, Told
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.lifecycle import State, Transition


class ControlCode(Enum):
    """``fenced``: not from the manager's current term; ``refused``: nothing was changed; ``failed``: it was tried."""

    FENCED = "fenced"
    MALFORMED = "malformed"
    REFUSED = "refused"
    FAILED = "failed"
    TIMED_OUT = "timed_out"


@message("regraft/ControlError")
@dataclass(frozen=True, slots=True)
class ControlError:
    """Why a control query did not do what it was asked."""

    code: ControlCode
    problems: tuple[Told, ...]


@message("regraft/SetTransition")
@dataclass(frozen=True, slots=True)
class SetTransition:
    """Ask for a lifecycle transition.

    ``hold`` asks who is deactivated to keep what comes for its inputs: if it is activated again, it handles that first.
    ``time`` (ns) is the simulated time: a component that nothing has woken for a while still has an older one.
    """

    transition: Transition
    term: Count | None = None
    revision: Count | None = None
    hold: bool = False
    time: Count | None = None


@message("regraft/ParameterValues")
@dataclass(frozen=True, slots=True)
class ParameterValues:
    """Parameter values: set atomically when sent with ``values``, only read when sent without."""

    values: dict[str, PlainValue] = field(default_factory=dict)
    term: Count | None = None
    revision: Count | None = None


@message("regraft/Peer")
@dataclass(frozen=True, slots=True)
class Peer:
    """The other end of a connection: one run of a component."""

    component: str
    incarnation: Count


class RewireStep(Enum):
    """Read connections; open the new topic next to the old; put a marker; wait for markers; switch; give up; leave."""

    READ = "read"
    OPEN = "open"
    MARK = "mark"
    AWAIT = "await"
    SWITCH = "switch"
    ABANDON = "abandon"
    DISCONNECT = "disconnect"


@message("regraft/Rewire")
@dataclass(frozen=True, slots=True)
class Rewire:
    """One step of rewiring a port (docs/protocol.md, "Rewiring").

    ``peers`` are the runs whose marker on ``topic`` is waited for. ``cuts`` is for an input that switches or is
    disconnected. It has, for each source, up to which sequence its data on the former topic is handled first.
    """

    step: RewireStep
    port: str = ""
    topic: str = ""
    peers: tuple[Peer, ...] = ()
    cuts: dict[str, Count] = field(default_factory=dict)
    term: Count | None = None
    revision: Count | None = None


@message("regraft/ComponentView")
@dataclass(frozen=True, slots=True)
class ComponentView:
    """A component as it is now: the reply to every control query that succeeded.

    ``faults`` counts the errors that it has reported, ``error`` is the last. ``connections`` are empty texts while
    it is not configured, and None for a port that is connected to no topic.
    """

    component: str
    incarnation: Count
    state: State
    revision: Count
    parameters: dict[str, PlainValue]
    connections: Connections
    detail: dict[str, PlainValue] = field(default_factory=dict)
    error: str = ""
    faults: Count = 0


@message("regraft/AskQualities")
@dataclass(frozen=True, slots=True)
class AskQualities:
    """Ask a component what quality it gives, and would give with these ``parameters`` changed, in this ``context``."""

    parameters: dict[str, PlainValue] = field(default_factory=dict)
    context: dict[str, PlainValue] = field(default_factory=dict)


@message("regraft/Qualities")
@dataclass(frozen=True, slots=True)
class Qualities:
    """Quality attributes by name: ``estimated`` without regard to the run (ES), ``evaluated`` from it (EV).

    ``evaluated`` is empty unless the component is active. The two are ReFrESH's (Cui et al., ICRA 2015). ``unknown`` is
    why something that was given does not count.
    """

    component: str
    incarnation: Count
    stamp: Seconds
    estimated: dict[str, float]
    evaluated: dict[str, float]
    unknown: dict[str, str] = field(default_factory=dict)


@message("regraft/Resend")
@dataclass(frozen=True, slots=True)
class Resend:
    """Ask a writer for samples that have not come: sequences ``first`` to ``last`` of an epoch of a key.

    ``last`` None means all that it has put, ``epoch`` 0 that the reader knows of none: the present one.
    """

    key: str
    epoch: Count
    first: Count
    last: Count | None = None


@message("regraft/ResentSample")
@dataclass(frozen=True, slots=True)
class ResentSample:
    """A sample as it was put: payload, attachment and encoding."""

    payload: bytes
    attachment: bytes
    encoding: str


@message("regraft/Resent")
@dataclass(frozen=True, slots=True)
class Resent:
    """The messages that the writer still has, in sequence, as much as one answer holds.

    ``last`` is the sequence that the key has come to in that epoch, None if the writer does not know.
    """

    samples: tuple[ResentSample, ...] = ()
    last: Count | None = None


class StateStep(Enum):
    """The operation on a state."""

    SNAPSHOT = "snapshot"
    RESTORE = "restore"


@message("regraft/StateRequest")
@dataclass(frozen=True, slots=True)
class StateRequest:
    """Ask for a component's state, or give it one."""

    step: StateStep
    state: PlainValue = None
    version: Count = 0
    term: Count | None = None


@message("regraft/Snapshot")
@dataclass(frozen=True, slots=True)
class Snapshot:
    """A component's state as plain data, with the version of its layout and how far its outputs' numbering has come.

    ``first_tick`` is in a time source's checkpoints: the machine's monotonic clock, in s, when the run began to tick.
    """

    component: str
    incarnation: Count
    stamp: float
    version: Count
    state: PlainValue
    outputs: dict[str, Count] = field(default_factory=dict)
    first_tick: float | None = None


MAX_SCHEMA_SIZE = 2**20
"""Characters that a JSON Schema may have."""


@message("regraft/AskTypes")
@dataclass(frozen=True, slots=True)
class AskTypes:
    """Ask a component for message types by name; without names, for those of its ports, services and actions."""

    names: tuple[str, ...] = ()


@message("regraft/TypeDescription")
@dataclass(frozen=True, slots=True)
class TypeDescription:
    """A message type: the encoding of its payloads, and its JSON Schema (2020-12) as JSON text."""

    name: str
    version: Count
    encoding: str
    schema: Annotated[str, Text(MAX_SCHEMA_SIZE)]


@message("regraft/KnownTypes")
@dataclass(frozen=True, slots=True)
class KnownTypes:
    """The message types that were asked for, as far as the component knows them."""

    types: tuple[TypeDescription, ...]
