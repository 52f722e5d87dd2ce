"""Robots of a world as data: the parameter ``robots`` of everything that looks at the world."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, ClassPath, FilePath, Metres, Named, PlainValue, Radians, Text
from regraft.bus_schema.errors import BadMessage


@dataclass(frozen=True, slots=True)
class Place:
    """The ground pose of a robot's base at the start, in the map frame."""

    x: Metres
    y: Metres
    yaw: Radians = 0.0


@dataclass(frozen=True, slots=True)
class Region:
    """The rectangle (map frame) in which a robot's place is drawn, with room around it."""

    x: tuple[float, ...]
    y: tuple[float, ...]
    gap: Annotated[Metres, Bounds(0.0)] = 0.1
    """Distance of the robot's outline to everything else."""

    def __post_init__(self) -> None:
        for name, limits in (("x", self.x), ("y", self.y)):
            if len(limits) != 2 or limits[0] > limits[1]:
                raise BadMessage(f"{list(limits)}: must be [low, high]", (name,))


@dataclass(frozen=True, slots=True)
class DeviceSpec:
    """A device of a robot: its name, class (a `Device`), values of its parameters, and topics of its ports."""

    name: Annotated[str, Text(64)]
    cls: ClassPath
    parameters: dict[str, PlainValue] = field(default_factory=dict)
    connections: Annotated[dict[str, str], Named("connect")] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RobotSpec:
    """A robot of a world.

    Its MJCF elements, topics and ports have short names in its own files. In the world they begin with ``NAME/``,
    unless the name is empty. ``model`` is the MJCF file that is attached to the world. Without a model the world file
    has the robot itself, as the body ``base``. A robot with a model has a ``place``, or one is drawn in a ``region``.
    Else the world file's rules place it, or it stands where its MJCF has it.
    """

    name: Annotated[str, Text(64)] = ""
    model: FilePath = ""
    base: str = "base"
    radius: Annotated[Metres, Bounds(0.0)] = 0.2
    """Of a circle around the base's origin that contains the robot, seen from above."""
    place: Place | None = None
    region: Region | None = None
    devices: tuple[DeviceSpec, ...] = ()

    def __post_init__(self) -> None:
        if self.place is not None and self.region is not None:
            raise BadMessage("a robot has a place or a region, not both", ("region",))
        if self.place is not None and not self.model:
            raise BadMessage("without a model, the world's file has the robot at its place", ("place",))

    @property
    def prefix(self) -> str:
        """The begin of the names of its elements, topics and ports."""
        return f"{self.name}/" if self.name else ""

    @property
    def body(self) -> str:
        """The name of its base in the world."""
        return self.prefix + self.base
