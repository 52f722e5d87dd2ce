"""Components, a message type and a broken class for stacks under test."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from regraft import Component, Input, Output, Parameter, Records, action, service
from regraft.bus_schema.annotations import ClassPath, PlainValue
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo
from regraft.bus_schema.messages.sensors import LaserScan, Odometry
from regraft.bus_schema.model.description import Resources
from regraft.component.parameters import ParameterError
from regraft.lockstep.source import TimeSource


@message("stacktest/Smell")
@dataclass(frozen=True, slots=True)
class Smell:
    """What a nose smells."""

    strength: float


class World(TimeSource):
    """A world."""

    velocity = Input(Twist, required=False)
    odometry = Output(Odometry)
    scan = Output(LaserScan)

    file = Parameter("", "the world's model", unit="path", read_only=True)
    mesh = Parameter("", "a shape in it", unit="path", exists=True)

    def advance(self, tick: int, seconds: float) -> None:
        """Go on."""


@dataclass(frozen=True, slots=True)
class Device:
    """A device of a robot, as a world takes it."""

    name: str
    cls: ClassPath
    parameters: dict[str, PlainValue] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse beams that no lidar has."""
        beams = self.parameters.get("beams", 1)
        if not isinstance(beams, int) or beams < 1:
            raise BadMessage(f"{beams!r}: must be at least 1", ("parameters", "beams"))


@dataclass(frozen=True, slots=True)
class Place:
    """Where a robot begins."""

    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot, as a world takes it."""

    name: str
    model: str
    devices: tuple[Device, ...]
    place: Place | None = None


class Fleet(TimeSource):
    """A world of several robots."""

    file = Parameter("", "the world's model", unit="path", read_only=True)
    robots = Records(Robot, "the robots in it")

    def advance(self, tick: int, seconds: float) -> None:
        """Go on."""


class Eyes(Component):
    """Sees where it is."""

    odometry = Output(Odometry)
    scan = Output(LaserScan)


class Signals(Component):
    """Hears what all do."""

    clock_like = Input(Twist, topic="/clock_like", required=False)
    horn = Parameter("", "a sound", unit="path")

    @service("honk")
    def honk(self, request: NavigateTo) -> Arrival:
        """Honk."""
        raise NotImplementedError


class Navigator(Component):
    """Drives."""

    odometry = Input(Odometry)
    scan = Input(LaserScan, latest_only=True)
    smell = Input(Smell, required=False)
    velocity = Output(Twist)

    max_velocity = Parameter(0.26, minimum=0.0, maximum=0.26, unit="m/s")
    planner = Parameter("grid", choices=("grid", "straight"))
    gains = Parameter((1.0, 2.0), minimum=0.0)
    careful = Parameter(False)

    @action("navigate_to")
    async def navigate_to(self, goal: NavigateTo) -> Arrival:
        """Drive to a pose."""
        raise NotImplementedError


class Drive(Component):
    """Goes as fast as its motor, with a gear for each number of teeth."""

    velocity = Output(Twist)

    top_speed = Parameter(1.0, read_only=True)
    speed = Parameter(0.5, minimum=0.0, limit="top_speed")
    teeth = Parameter((), read_only=True)

    @classmethod
    def parameters_for(cls, parameters: dict[str, Any]) -> Iterable[Parameter[Any]]:
        """Return a gear for each; raises ParameterError if one has no teeth."""
        for index, count in enumerate(parameters["teeth"]):
            if count < 1:
                raise ParameterError([(f"teeth.{index}", f"{count}: must be at least 1")])
            yield Parameter(1.0).renamed(f"gear_{count}", 1.0)


class Joystick(Component):
    """Drives too."""

    velocity = Output(Twist)

    layout = Parameter("", "what its buttons do", unit="path", exists=True)


class Gripper(Component):
    """Holds a device that only one may hold."""

    resources = Resources(devices=("/dev/gripper",))


class Squeezer(Gripper):
    """Needs much of what a host has."""

    resources = Resources(devices=("/dev/gripper",), amounts={"grip": 1.5})


class Presser(Component):
    """Needs a little of the same."""

    resources = Resources(amounts={"grip": 0.75})


class Negative(Component):
    """Needs less than nothing."""

    resources = Resources(amounts={"grip": -1.0})


class Doubled(Component):
    """Calls memory an amount of another kind."""

    resources = Resources(amounts={"memory": 1.0})


class Plain:
    """No component."""
