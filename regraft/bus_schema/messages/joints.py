"""Joints and grippers: commands and states, in rad for hinges and m for slides."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from regraft.bus_schema.annotations import Array, Bounds, Metres, Newtons, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadMessage

JointValues = Annotated[NDArray[np.float64], Array("<f8", (None,))]


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


@message("regraft/JointStates")
@dataclass(frozen=True, slots=True)
class JointStates:
    """Positions (rad, m), velocities (rad/s, m/s) and torques (N m, N) of joints, in the order of their names."""

    stamp: Seconds
    names: tuple[str, ...]
    positions: JointValues
    velocities: JointValues
    torques: JointValues

    def __post_init__(self) -> None:
        for name in ("positions", "velocities", "torques"):
            if len(getattr(self, name)) != len(self.names):
                raise BadMessage(f"must have one value for each of {len(self.names)} names", (name,))


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
