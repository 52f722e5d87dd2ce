"""A device's access to its world."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import mujoco
import numpy as np

from regraft.sim_service.devices.core.failure_schedule import NONE
from regraft.sim_service.layout.random_streams import generator
from regraft.sim_service.layout.scene import Scene
from regraft.sim_service.robots import RobotSpec

D = TypeVar("D")

ROUNDING = 1e-9
"""Part of a measurement by which the computed number of measurements may fall short."""


@dataclass(slots=True)
class Progress:
    """How far a simulation has come, in physics steps of ``timestep`` seconds, of which a tick has several."""

    timestep: float
    steps_per_tick: int
    steps: int = 0
    stamp: float = 0.0
    """Time (s) of the system's clock at this tick."""

    @property
    def time(self) -> float:
        """Simulated time (s) since the start."""
        return self.steps * self.timestep

    @property
    def tick(self) -> int:
        """World ticks since the start."""
        return self.steps // self.steps_per_tick

    @property
    def tick_rate(self) -> float:
        """World ticks per second."""
        return 1.0 / (self.steps_per_tick * self.timestep)


@dataclass(frozen=True, slots=True)
class DeviceParameters:
    """Values of a device's parameters, by their short names."""

    values: Mapping[str, Any]


def _no_event(kind: str, text: str, **details: Any) -> None:
    """Drop an event: this simulation has no bus."""


def _full_light() -> float:
    """Return the level of lamps that nobody dims."""
    return 1.0


@dataclass(slots=True)
class DeviceKit:
    """The world as one device of one robot sees it. Names are the short ones of the robot's own files.

    ``data`` is the physics at present. ``failing`` is how the device fails now. ``event`` reports to the system that
    something happened. ``siblings`` are the robot's devices by name, those that come before this one in its file.
    """

    name: str
    robot: RobotSpec
    scene: Scene
    model: mujoco.MjModel
    data: mujoco.MjData
    seed: int
    progress: Progress
    parameters: DeviceParameters
    base: int
    siblings: Mapping[str, Any] = field(default_factory=dict)
    others: Callable[[], Mapping[str, Mapping[str, Any]]] = dict
    light: Callable[[], float] = _full_light
    event: Callable[..., None] = _no_event
    failing: str = NONE

    @property
    def time(self) -> float:
        """Simulated time (s) since the start of the run."""
        return self.progress.time

    @property
    def stamp(self) -> float:
        """Time (s) of the system's clock at this tick."""
        return self.progress.stamp

    def others_of(self, kind: type[D]) -> Iterator[tuple[str, D]]:
        """Yield the other robots' devices of a kind, each with its robot's name, in the order of the robots."""
        for robot, devices in self.others().items():
            for device in devices.values():
                if isinstance(device, kind):
                    yield robot, device

    def index(self, kind: str, name: str) -> int:
        """Return the number of an element of the robot's MJCF; raises SceneError."""
        return self.scene.index(kind, self.robot.prefix + name)

    def frame(self, name: str) -> str:
        """Return the id of a coordinate frame of the robot."""
        return self.robot.prefix + name

    def random(self, purpose: str, moment: int) -> np.random.Generator:
        """Return the random numbers for a purpose at a moment, which depend on nothing else in the world."""
        return generator(self.seed, self.robot.prefix + purpose, moment)

    def is_due(self, rate: float) -> bool:
        """Return whether something that happens ``rate`` times a second happens at this tick; 0: at each."""
        return self._is_due(self.progress.tick, rate)

    def ticks_since_due(self, rate: float) -> int:
        """Return how many ticks ago that happened before this tick."""
        tick = self.progress.tick
        return next(ago for ago in itertools.count(1) if self._is_due(tick - ago, rate))

    def _is_due(self, tick: int, rate: float) -> bool:
        return not rate or self._times(tick, rate) > self._times(tick - 1, rate)

    def _times(self, tick: int, rate: float) -> int:
        """Return how often something has happened by a tick."""
        return math.floor(tick * rate / self.progress.tick_rate + ROUNDING)
