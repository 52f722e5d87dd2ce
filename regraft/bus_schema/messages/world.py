"""Messages of a simulated world: the truth for evaluation, and its state for the cameras that look at it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from regraft.bus_schema.annotations import Array, Count, Ratio, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.geometry import Pose, Twist


@message("regraft/GroundTruth")
@dataclass(frozen=True, slots=True)
class GroundTruth:
    """The robot's true pose in ``map``, its true velocity, what it touches now, and contacts begun since the start."""

    stamp: Seconds
    tick: Count
    pose: Pose
    twist: Twist
    touching: tuple[str, ...] = ()
    contacts: Count = 0


@dataclass(frozen=True, slots=True)
class GeomColour:
    """A geom (by its number in the compiled world) in a colour of its own, such as a robot's lamp."""

    geom: Count
    red: Ratio
    green: Ratio
    blue: Ratio


@message("regraft/WorldState", 2)
@dataclass(frozen=True, slots=True)
class WorldState:
    """All that a camera needs to render a tick: joint positions (MuJoCo ``qpos``), base pose, and light level (1 full).

    ``model_hash`` distinguishes the compiled world from others; ``seed`` fixes placements and image noise.
    ``colours`` are those of geoms that shine; all others look as in the world's files.
    """

    stamp: Seconds
    tick: Count
    seed: Count
    model_hash: str
    positions: Annotated[NDArray[np.float64], Array("<f8", (None,))]
    light: Ratio
    base: Pose
    colours: tuple[GeomColour, ...] = ()
