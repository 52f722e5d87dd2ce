"""The base of all devices: a part of a robot that the world simulates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from regraft.bus_schema.annotations import PlainValue
from regraft.sim_service.cameras.camera import Rgb
from regraft.sim_service.devices.core.device_kit import DeviceKit


class Device:
    """A part of a robot that senses or acts in a world.

    A device declares parameters and ports as a component does. The world has them under the robot's name:
    ``rescuer/scan`` is the port ``scan``, ``rescuer/lidar_noise`` the parameter ``noise`` of the device ``lidar``.
    Its kit gives it the world's elements, random numbers and the time.

    The world calls, in this order: ``build`` once; handlers of inputs before each tick; ``act`` before and ``watch``
    after each control period; ``tick`` after each world tick; then ``sense``, in the order of the robot's file.
    One of these that raises is a fault of the world, which names robot and device. All others are called as ever.
    """

    kit: DeviceKit

    def build(self) -> None:
        """Find the device's elements in the world, as it is at the start; raises SceneError."""

    def act(self) -> None:
        """Write to the actuators."""

    def watch(self) -> None:
        """Look at the world between two control periods, where a tick would be too coarse."""

    def tick(self) -> None:
        """Measure what has to be measured at each tick, such as the way of a wheel."""

    def sense(self) -> None:
        """Publish what is due."""

    def colours(self) -> Mapping[int, Rgb]:
        """Return the colours of geoms that shine, by their numbers in the world."""
        return {}

    def truth(self) -> dict[str, float]:
        """Return what really is, for evaluation; numbers by name."""
        return {}

    def evaluate(self) -> dict[str, float]:
        """Return the qualities that the device gives now: numbers by the name of a `Quality` of its class.

        If it raises, these alone are unknown.
        """
        return {}

    def snapshot(self) -> PlainValue:
        """Return, as plain data, the state that is not part of the physics; None if there is none."""
        return None

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a state that ``snapshot`` returned."""
