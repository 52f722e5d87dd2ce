"""Calls devices, and names the one that raises."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ParamSpec, TypeVar

from regraft.bus_schema.texts import text_of, told
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.layout.scene import SceneError

P = ParamSpec("P")
R = TypeVar("R")


class DeviceError(SceneError):
    """A device raised an exception; the text names both."""

    def __init__(self, robot: str, device: str, error: Exception) -> None:
        self.robot, self.device = robot, device
        of = f" of the robot {robot!r}" if robot else ""
        why = text_of(error) if isinstance(error, ValueError) else told(error)
        super().__init__(f"the device {device!r}{of}: {why}")


class DeviceErrors(SceneError):
    """Several devices raised an exception each; the text names all."""

    def __init__(self, errors: Sequence[DeviceError]) -> None:
        super().__init__("; ".join(str(error) for error in errors))


class Calls:
    """Calls devices, the others also where one raises: it may harm nobody else.

    Attributes:
        errors: the first exception of each device that raised.
    """

    def __init__(self) -> None:
        self.errors: list[DeviceError] = []

    def call(self, device: Device, method: Callable[[], R]) -> R | None:
        """Call a method of a device; return None if it raises."""
        try:
            return call(device, method)
        except DeviceError as error:
            if all((error.robot, error.device) != (other.robot, other.device) for other in self.errors):
                self.errors.append(error)
            return None

    def raise_all(self) -> None:
        """Raise what devices have raised: DeviceError, or DeviceErrors if there were several."""
        if len(self.errors) > 1:
            raise DeviceErrors(self.errors) from self.errors[0]
        for error in self.errors:
            raise error


def call(device: Device, method: Callable[P, R], *arguments: P.args, **named: P.kwargs) -> R:
    """Call a method of a device; raises DeviceError."""
    try:
        return method(*arguments, **named)
    except Exception as error:
        raise DeviceError(device.kit.robot.name, device.kit.name, error) from error
