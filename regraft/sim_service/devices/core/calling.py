"""Calls devices, and names the one that raises."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.layout.scene import SceneError


class DeviceError(SceneError):
    """A device raised an exception; the text names both."""

    def __init__(self, robot: str, device: str, error: Exception) -> None:
        self.robot, self.device = robot, device
        of = f" of the robot {robot!r}" if robot else ""
        kind = "" if isinstance(error, ValueError) else f"{type(error).__name__}: "
        super().__init__(f"the device {device!r}{of}: {kind}{error}")


def call(device: Device, method: str, *arguments: Any) -> Any:
    """Call a method of a device; raises DeviceError."""
    try:
        return getattr(device, method)(*arguments)
    except Exception as error:
        raise DeviceError(device.kit.robot.name, device.kit.name, error) from error


def call_each(devices: Iterable[Device], method: str) -> None:
    """Call a method without arguments of each device; raises DeviceError."""
    for device in devices:
        call(device, method)
