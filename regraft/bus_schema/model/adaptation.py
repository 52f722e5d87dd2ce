"""Adaptations: lists of changes applied as one transaction, and what became of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, ClassVar

from regraft.bus_schema.annotations import (
    Bounds,
    ClassPath,
    Connections,
    Count,
    PlainValue,
    Seconds,
    Tagged,
    Text,
    ToldBriefly,
)
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec
from regraft.bus_schema.model.lifecycle import Transition
from regraft.bus_schema.model.qualities.estimates import Estimate
from regraft.bus_schema.model.watched import Breach, Condition

ADAPT = "adaptation_manager/adapt"
UNDO = "adaptation_manager/undo"
CANCEL = "adaptation_manager/cancel"
CONFIRM = "adaptation_manager/confirm"
JOURNAL = "adaptation_manager/journal"
ARCHITECTURE = "adaptation_manager/architecture"
ARCHITECTURE_TAG = "adaptation_manager/architecture_tag"
"""The services of the adaptation manager."""

MAX_CONTEXT_SIZE = 16_384
"""The greatest size of a request's context, as `plain_size` measures it."""
MAX_PARAMETERS_SIZE = 500_000
"""The greatest size of one change's parameters; those of any stack file fit, so that each change can be undone."""

MAX_WATCHED = 100
"""The most conditions that a request has watched: each is looked at ten times a second."""


@dataclass(frozen=True, slots=True)
class SetParameters:
    """Reparameterisation: several parameters of a component, all or none."""

    change: ClassVar[str] = "set_parameters"
    component: str
    parameters: dict[str, PlainValue]


@dataclass(frozen=True, slots=True)
class Connect:
    """Change of connection: a port moves to another topic, with nothing lost and nothing doubled.

    ``topic`` None disconnects it: an input first handles what has been put by then.
    """

    change: ClassVar[str] = "connect"
    component: str
    port: str
    topic: str | None


@dataclass(frozen=True, slots=True)
class ChangeState:
    """A lifecycle transition."""

    change: ClassVar[str] = "transition"
    component: str
    transition: Transition


@dataclass(frozen=True, slots=True)
class Add:
    """Addition: a new component, its process included.

    The class's own description, and the topics of ports that ``spec.connect`` leaves out, are filled in.
    ``topics`` are new ones that the system gets with it. ``resume`` lets it continue as after a crash:
    from the last checkpoint of a removed component of its name, if there is one.
    """

    change: ClassVar[str] = "add"
    component: str
    spec: ComponentSpec
    topics: tuple[TopicSpec, ...] = ()
    resume: bool = False


@dataclass(frozen=True, slots=True)
class Remove:
    """Removal: the component and its process end. ``topics`` go with it: nobody else may be connected to them."""

    change: ClassVar[str] = "remove"
    component: str
    topics: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Swap:
    """Exchange: another class, or the same one configured otherwise, takes the component's place.

    It gets the component's name, place in the lifecycle, and state. Where both classes have them, it also keeps the
    parameters, connections and services that are not given here. ``cls`` is empty for the present class.
    ``with_state`` False lets it begin without the state.
    """

    change: ClassVar[str] = "swap"
    component: str
    cls: ClassPath = ""
    parameters: dict[str, PlainValue] = field(default_factory=dict)
    connections: Connections = field(default_factory=dict)
    services: dict[str, str] = field(default_factory=dict)
    with_state: bool = True


@dataclass(frozen=True, slots=True)
class Move:
    """Redeployment: the component continues on another host, with its state unless ``with_state`` is False."""

    change: ClassVar[str] = "move"
    component: str
    host: str
    with_state: bool = True


@dataclass(frozen=True, slots=True)
class EnterMode:
    """A named set of changes, as the stack defines it; it concerns no ``component`` by itself."""

    change: ClassVar[str] = "mode"
    mode: str
    component: str = ""


Change = Annotated[
    SetParameters | Connect | ChangeState | Add | Remove | Swap | Move | EnterMode,
    Tagged("change"),
]


class Outcome(Enum):
    """How an adaptation ended, or that it has not: ``pending``, and ``confirming`` once it only has to be confirmed."""

    PENDING = "pending"
    CONFIRMING = "confirming"
    APPLIED = "applied"
    REJECTED = "rejected"
    ROLLED_BACK = "rolled_back"
    CANCELLED = "cancelled"
    APPLIED_STATE_LOST = "applied_state_lost"
    STUCK = "stuck"


APPLIED = (Outcome.APPLIED, Outcome.APPLIED_STATE_LOST)
"""The outcomes after which the changes hold."""


@message("regraft/AdaptationRequest")
@dataclass(frozen=True, slots=True)
class AdaptationRequest:
    """A request for changes. ``revision`` is the one that the caller saw; stale is refused.

    ``key`` makes a repeated request the same adaptation. A dry run touches nothing. ``wait`` False answers as soon as
    the request is queued; a dry run is always waited for. ``context`` has the circumstances of the request: a map of
    plain data for the journal's readers. It has at most the size 16,384, where a text counts its characters and any
    other value 8. The parameters of a change may have the size 500,000.

    ``confirm`` seconds of the components' clock, if any, it is watched before it is final. It is undone if one of its
    components fails, or if a condition of ``watch`` does not hold; a text among these is a requirement.
    """

    changes: tuple[Change, ...]
    reason: Annotated[str, Text(1000)] = ""
    actor: Annotated[str, Text(200)] = ""
    revision: Count | None = None
    key: Annotated[str, Text(200)] = ""
    dry_run: bool = False
    wait: bool = True
    undoes: str = ""
    context: dict[str, PlainValue] = field(default_factory=dict)
    confirm: Annotated[Seconds, Bounds(0.0, 86_400.0)] = 0.0
    watch: tuple[Condition, ...] = ()

    def __post_init__(self) -> None:
        given: tuple[Condition | str, ...] = self.watch
        watch = tuple(Condition(each) if isinstance(each, str) else each for each in given)
        object.__setattr__(self, "watch", watch)
        if len(self.watch) > MAX_WATCHED:
            raise BadMessage(f"has {len(self.watch)} conditions, must have at most {MAX_WATCHED}", ("watch",))
        _check_size(self.context, MAX_CONTEXT_SIZE, "context")
        for index, change in enumerate(self.changes):
            _check_size(_parameters(change), MAX_PARAMETERS_SIZE, "changes", str(index), "parameters")


def _parameters(change: Change) -> dict[str, PlainValue]:
    if isinstance(change, Add):
        return change.spec.parameters
    return change.parameters if isinstance(change, SetParameters | Swap) else {}


def _check_size(plain: PlainValue, largest: int, *where: str) -> None:
    size = plain_size(plain, largest)
    if size > largest:
        raise BadMessage(f"has the size {size}, must be at most {largest}", where)


def plain_size(plain: PlainValue, largest: int) -> int:
    """Return how large plain data is: the characters of its texts, the bytes of its bytes, 8 for any other value.

    It is counted until it is larger than ``largest``.
    """
    size, left = 0, [plain]
    while left and size <= largest:
        value = left.pop()
        if isinstance(value, str | bytes):
            size += len(value)
        else:
            size += 8
        if isinstance(value, dict):
            left.extend(value.keys())
            left.extend(value.values())
        elif isinstance(value, list | tuple):
            left.extend(value)
    return size


@message("regraft/Violation")
@dataclass(frozen=True, slots=True)
class Violation:
    """One thing wrong with a request: the change's index, the component and field, what is wrong and what would do."""

    change: int | None
    component: str
    field: ToldBriefly
    problem: ToldBriefly

    @property
    def place(self) -> str:
        """Component and field as people write them: ``camera.rate``; one of them alone where the other is empty."""
        return ".".join(filter(None, (self.component, self.field)))

    def __str__(self) -> str:
        """The place and what is wrong there."""
        return ": ".join(filter(None, (self.place, self.problem)))


class StepState(Enum):
    """How far a step has come."""

    PLANNED = "planned"
    STARTED = "started"
    DONE = "done"
    FAILED = "failed"
    UNDONE = "undone"
    UNDO_FAILED = "undo_failed"


@message("regraft/StepReport")
@dataclass(frozen=True, slots=True)
class StepReport:
    """One step of an adaptation: what it does, to whom, how far it came, how long it took, what went wrong."""

    number: Count
    component: str
    action: ToldBriefly
    state: StepState
    duration: Seconds = 0.0
    error: ToldBriefly = ""


class Phase(Enum):
    """The phases of an adaptation, in their order; what it does not need is left out."""

    CHECK = "check"
    PREPARE = "prepare"
    COMMIT = "commit"
    VERIFY = "verify"
    CONFIRM = "confirm"


@message("regraft/PhaseReport")
@dataclass(frozen=True, slots=True)
class PhaseReport:
    """How long a phase took: wall-clock seconds, in ``confirm`` those of the components' clock."""

    phase: Phase
    duration: Seconds = 0.0


class UnreachedCode(Enum):
    """Why a component is not reached: how its host is, or that it does not run or answer itself."""

    HOST_ABSENT = "host_absent"
    HOST_LEFT = "host_left"
    HOST_SILENT = "host_silent"
    HOST_LOST = "host_lost"
    NOT_RUNNING = "not_running"
    NO_ANSWER = "no_answer"


@message("regraft/Unreached")
@dataclass(frozen=True, slots=True)
class Unreached:
    """A component that an adaptation names, and that could not be asked in its check, or in its undo.

    The architecture holds for it all the same: it gets it when it is back. ``why`` is in words.
    """

    component: str
    code: UnreachedCode
    host: str
    why: ToldBriefly = ""


@message("regraft/AdaptationReport")
@dataclass(frozen=True, slots=True)
class AdaptationReport:
    """An adaptation's line in the journal. ``tick`` is the world tick in which it was applied, None in real time.

    ``revision_after`` of one that is being confirmed is that of the architecture that is not final yet. A dry run has
    the ``architecture`` that would result, and an ``estimate``. ``broken`` is what did not hold if it was not
    confirmed. ``unreached`` are the components that it is about, and that did not answer as it was checked; also those
    on hosts that were not there as it was undone.
    """

    id: str
    outcome: Outcome
    request: AdaptationRequest
    revision_before: Count
    revision_after: Count
    started: Seconds
    duration: Seconds = 0.0
    tick: Count | None = None
    violations: tuple[Violation, ...] = ()
    steps: tuple[StepReport, ...] = ()
    error: ToldBriefly = ""
    architecture: Architecture | None = None
    phases: tuple[PhaseReport, ...] = ()
    estimate: Estimate | None = None
    broken: tuple[Breach, ...] = ()
    unreached: tuple[Unreached, ...] = ()
