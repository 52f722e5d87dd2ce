"""What a step does, as plain data, so that the journal can keep it and its inverse.

An action names the end that is to be reached, not the way there: performing it again, or after half of it was
done by somebody who died, leads to the same end. So one kind of action serves doing, undoing and recovery.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from bus_schema.annotations import PlainValue, Tagged
from bus_schema.lifecycle import State, Transition
from bus_schema.registry import message


@dataclass(frozen=True, slots=True)
class GiveValues:
    """The component has these parameter values."""

    action: ClassVar[str] = "give_values"
    component: str
    values: dict[str, PlainValue]


@dataclass(frozen=True, slots=True)
class ConnectPort:
    """The port is connected to this topic (no matter while the component is unconfigured)."""

    action: ClassVar[str] = "connect_port"
    component: str
    port: str
    topic: str


@dataclass(frozen=True, slots=True)
class ReachState:
    """The component is in this state; on being configured, its ports get these connections.

    ``by`` is the one transition that may be used; None for any route.
    """

    action: ClassVar[str] = "reach_state"
    component: str
    state: State
    connections: dict[str, str]
    by: Transition | None = None


Action = Annotated[GiveValues | ConnectPort | ReachState, Tagged("action")]


@message("adaptation_manager/PlannedStep")
@dataclass(frozen=True, slots=True)
class PlannedStep:
    """A step of a plan: what it does in words, the end it reaches, and the end that undoes it."""

    component: str
    text: str
    do: Action
    undo: Action
