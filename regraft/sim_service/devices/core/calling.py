"""Calls devices, and names the one that raises."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.layout.scene import SceneError

P = ParamSpec("P")
R = TypeVar("R")


class DeviceError(SceneError):
    """A device raised an exception; the text names both."""

    def __init__(self, robot: str, device: str, error: Exception) -> None:
        self.robot, self.device = robot, device
        of = f" of the robot {robot!r}" if robot else ""
        kind = "" if isinstance(error, ValueError) else f"{type(error).__name__}: "
        super().__init__(f"the device {device!r}{of}: {kind}{error}")


def call(device: Device, method: Callable[P, R], *arguments: P.args, **named: P.kwargs) -> R:
    """Call a method of a device; raises DeviceError."""
    try:
        return method(*arguments, **named)
    except Exception as error:
        raise DeviceError(device.kit.robot.name, device.kit.name, error) from error
