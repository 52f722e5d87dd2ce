"""The base of devices that measure, and the ways in which all of them can fail."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

from regraft import Parameter
from regraft.bus_schema.encoding import codec
from regraft.component.component import declared
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.core.failure_schedule import FROZEN, NONE, SILENT


def failure_parameter(*failures: str) -> Parameter[str]:
    """Declare how a sensor can fail: silent, frozen, and in these ways of its own."""
    return Parameter(NONE, "how it fails now", choices=(NONE, SILENT, FROZEN, *failures))


class Sensor(Device):
    """Publishes a message now and then. A silent sensor sends nothing, a frozen one its last message.

    A subclass has the output and measures. It spoils its measurements by the failures of its own.
    """

    measures: ClassVar[str]
    """The name of the output."""

    rate = Parameter(0.0, "measurements per second; 0: one each tick", minimum=0.0, unit="Hz", read_only=True)
    failure = failure_parameter()

    _shown: Any = None
    _packed: tuple[Any, bytes] = (None, b"")
    """A message, and its bytes: most checkpoints have the same one as the last."""

    def measure(self) -> Any:
        """Return a message with what it measures now."""
        raise NotImplementedError

    def sense(self) -> None:
        """Publish a measurement, if one is due."""
        failing = self.kit.failing
        if failing == SILENT or not self.kit.is_due(self.rate):
            return
        if failing != FROZEN or self._shown is None:
            self._shown = self.measure()
        shown, stamp = self._shown, self.kit.stamp
        getattr(self, self.measures).publish(shown if shown.stamp == stamp else replace(shown, stamp=stamp))

    def snapshot(self) -> dict[str, Any]:
        """Return the last message."""
        shown = self._shown
        if shown is not None and self._packed[0] is not shown:
            self._packed = (shown, codec.encode(shown))
        return {"shown": None if shown is None else self._packed[1]}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over the last message."""
        message = declared(type(self)).outputs[self.measures].message
        self._shown = None if state["shown"] is None else codec.decode(state["shown"], message)
