"""The actions of a step, as plain data, so that the journal can keep them and their inverses.

An action names the end that is to be reached, not the way there: performing it again, or after half of it was
done by somebody who died, leads to the same end. So one kind of action serves doing, undoing and recovery.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from regraft.bus_schema.annotations import Connections, Count, PlainValue, Tagged, ToldBriefly
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import DOWNWARD, State, Transition


@dataclass(frozen=True, slots=True)
class ApplyParameters:
    """The component has these parameter values."""

    action: ClassVar[str] = "give_values"
    component: str
    values: dict[str, PlainValue]


@dataclass(frozen=True, slots=True)
class ConnectPort:
    """The port is connected to this topic, None for none (no matter while the component is unconfigured)."""

    action: ClassVar[str] = "connect_port"
    component: str
    port: str
    topic: str | None


@dataclass(frozen=True, slots=True)
class ReachState:
    """The component is in this state; on being configured, its ports get these connections.

    ``by`` is the one transition that may be used; None for any route. With ``hold`` it keeps what comes, if it is
    deactivated for this: it may have to continue.
    """

    action: ClassVar[str] = "reach_state"
    component: str
    state: State
    connections: Connections
    by: Transition | None = None
    hold: bool = False

    @property
    def leads_down(self) -> bool:
        """Whether the component is to do less: then one that fails on its way has done what was asked of it."""
        return self.hold or self.by in DOWNWARD


@dataclass(frozen=True, slots=True)
class StayDown:
    """The component, which did not answer, is at most in this state, or has no process. It was asked for nothing.

    If it is to be active, it runs as its spec states, or is started as that.
    """

    action: ClassVar[str] = "stay_down"
    component: str
    host: str
    state: State


@dataclass(frozen=True, slots=True)
class ConnectAgain:
    """The component, which did not answer, has these connections if it does now; else its host starts it so."""

    action: ClassVar[str] = "connect_again"
    component: str
    connections: Connections


@dataclass(frozen=True, slots=True)
class RunProcess:
    """The component's process runs as ``spec`` states, in ``state`` (unconfigured or inactive), and is not restarted.

    A program that is unmanaged just runs. ``resume`` is that of the addition; ``afresh`` leaves the last checkpoint.
    ``leave_out`` incarnations are left to runs on a lost host that nobody heard of.
    """

    action: ClassVar[str] = "run_process"
    component: str
    spec: ComponentSpec
    state: State
    resume: bool = False
    leave_out: Count = 0
    afresh: bool = False


@dataclass(frozen=True, slots=True)
class Activate:
    """The component, which has just been started, is wired to whom it reads and who reads it, and active."""

    action: ClassVar[str] = "take_part"
    component: str


@dataclass(frozen=True, slots=True)
class EndProcess:
    """The component has no process, and its host has forgotten it."""

    action: ClassVar[str] = "end_process"
    component: str
    host: str


@dataclass(frozen=True, slots=True)
class LeaveStopped:
    """The component has no process, but its host knows it, and starts it when someone asks for that."""

    action: ClassVar[str] = "leave_stopped"
    component: str
    host: str


@dataclass(frozen=True, slots=True)
class StartAgain:
    """The component's host starts it as its spec states, and again whenever it ends, as before.

    If it was ``unconfigured``, it is so again: what had failed is not activated.
    """

    action: ClassVar[str] = "start_again"
    component: str
    host: str
    unconfigured: bool = False


@dataclass(frozen=True, slots=True)
class RunSuccessor:
    """Next to the component's run that began as ``incumbent`` runs a successor, as ``spec`` states, ready to take over.

    It may be on another host.
    """

    action: ClassVar[str] = "run_successor"
    component: str
    spec: ComponentSpec
    incumbent: Count
    with_state: bool


@dataclass(frozen=True, slots=True)
class EndSuccessor:
    """``incumbent`` is the only run of its component on ``host``."""

    action: ClassVar[str] = "end_successor"
    component: str
    host: str
    incumbent: Count


@dataclass(frozen=True, slots=True)
class TakeOver:
    """The successor of ``incumbent`` speaks for the component, in ``state``, and has all that this knew.

    ``host`` is that of the incumbent.
    """

    action: ClassVar[str] = "take_over"
    component: str
    host: str
    incumbent: Count
    state: State


@dataclass(frozen=True, slots=True)
class Restore:
    """The run that began as ``incumbent`` speaks for the component, with all that its successor knew if that can be.

    ``host`` is that of the incumbent, ``successor_host`` that of its successor, empty for the same.
    """

    action: ClassVar[str] = "give_back"
    component: str
    host: str
    incumbent: Count
    successor_host: str = ""


Action = Annotated[
    ApplyParameters
    | ConnectPort
    | ReachState
    | StayDown
    | ConnectAgain
    | RunProcess
    | Activate
    | EndProcess
    | LeaveStopped
    | StartAgain
    | RunSuccessor
    | EndSuccessor
    | TakeOver
    | Restore,
    Tagged("action"),
]


@message("adaptation_manager/PlannedStep")
@dataclass(frozen=True, slots=True)
class PlannedStep:
    """A step of a plan: what it does in words, the end it reaches, and the end that undoes it."""

    component: str
    text: ToldBriefly
    do: Action
    undo: Action
