"""Maps of the ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from bus_schema.annotations import Array, Metres, Seconds, SignedByteArray
from bus_schema.messages.geometry import FramedPose, Pose
from bus_schema.registry import message


@message("regraft/OccupancyGrid")
@dataclass(frozen=True, slots=True)
class OccupancyGrid:
    """Occupancy in per cent, -1 unknown; ``cells[row, column]`` covers x from column, y from row, times ``resolution``.

    ``origin`` is the pose of the corner of cell (0, 0) in ``frame``.
    """

    stamp: Seconds
    frame: str
    resolution: Metres
    origin: Pose
    cells: Annotated[SignedByteArray, Array("|i1", (None, None), tail=True)]


@message("regraft/NamedGoal")
@dataclass(frozen=True, slots=True)
class NamedGoal:
    """A place worth visiting: a pose from which the object ``name`` is looked at."""

    name: str
    pose: FramedPose


@message("regraft/Goals")
@dataclass(frozen=True, slots=True)
class Goals:
    """The places of a mission, in the order of their visits."""

    stamp: Seconds
    goals: tuple[NamedGoal, ...]
