"""Joints and grippers: commands and states, in rad for hinges and m for slides."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Metres, Newtons, Seconds
from regraft.bus_schema.encoding.registry import message


class JointMode(Enum):
    """The quantity that a joint is commanded in."""

    POSITION = "position"
    """rad, or m."""
    VELOCITY = "velocity"
    """rad/s, or m/s."""
    TORQUE = "torque"
    """N m, or N."""


@message("regraft/JointCommand")
@dataclass(frozen=True, slots=True)
class JointCommand:
    """A command for each named joint, all in one mode; other joints keep theirs."""

    mode: JointMode
    values: dict[str, float]


@dataclass(frozen=True, slots=True)
class JointState:
    """Position (rad, m), velocity (rad/s, m/s) and torque (N m, N) of a joint."""

    position: float
    velocity: float
    torque: float


@message("regraft/JointStates")
@dataclass(frozen=True, slots=True)
class JointStates:
    """The states of joints, by their names."""

    stamp: Seconds
    joints: dict[str, JointState]


@message("regraft/GripperCommand")
@dataclass(frozen=True, slots=True)
class GripperCommand:
    """Bring the fingers this far apart, and press with no more than this force; None for the most it can."""

    width: Annotated[Metres, Bounds(minimum=0.0)]
    force: Annotated[Newtons, Bounds(minimum=0.0)] | None = None


@message("regraft/GripperState")
@dataclass(frozen=True, slots=True)
class GripperState:
    """The fingers' distance, the force with which each closes (negative: opens), and whether they hold a thing."""

    stamp: Seconds
    width: Metres
    force: Newtons
    holding: bool
