"""Maps of the ground, what is asked of them, and where they end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Array, Count, Metres, Seconds, SignedByteArray, SquareMetres
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.geometry import FramedPose, Pose


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


@message("regraft/SaveMap")
@dataclass(frozen=True, slots=True)
class SaveMap:
    """Request: write the map to ``file`` (PNG and YAML side by side, as ROS's map_server does)."""

    file: str


@message("regraft/LoadMap")
@dataclass(frozen=True, slots=True)
class LoadMap:
    """Request: continue from the map in ``file``, as `SaveMap` wrote it."""

    file: str


@message("regraft/MapFile")
@dataclass(frozen=True, slots=True)
class MapFile:
    """Reply: the file that was written or read, and how much ground (m²) its map knows."""

    file: str
    known_area: SquareMetres


@message("regraft/NextFrontier")
@dataclass(frozen=True, slots=True)
class NextFrontier:
    """Request: where the map ends next. ``unreached``: the robot did not get to the one given before."""

    unreached: bool = False


@message("regraft/Frontier")
@dataclass(frozen=True, slots=True)
class Frontier:
    """Reply: whether the map still ends somewhere, from where to look there, and how many frontiers are left.

    ``length`` is that of the frontier itself, ``distance`` that of the way to ``goal``.
    """

    found: bool
    left: Count
    goal: FramedPose | None = None
    length: Metres = 0.0
    distance: Metres = 0.0
