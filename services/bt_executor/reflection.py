"""The system reflection (ReBeT, section IV): copies what topics say about the system to the root blackboard.

A tree then decides on ``{@darkness}`` or ``{@battery_charge}`` without knowing where they come from.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from bus_schema.messages.health import SensorHealth, SystemStatus
from bus_schema.messages.power import BatteryState
from bus_schema.messages.sensors import LightLevel
from regraft.runtime.inputs import Inputs
from services.bt_executor.engine import Blackboard


@dataclass(frozen=True, slots=True)
class Reflected:
    """One blackboard entry: the input it comes from, its key and type, and how it is read from a message."""

    input: str
    key: str
    type: type
    read: Callable[[Any], Any]


def _charge(battery: BatteryState) -> float:
    return battery.charge


def _darkness(light: LightLevel) -> float:
    return light.darkness


def _problems(status: SystemStatus) -> str:
    return "; ".join(status.problems)


def _sensor_faults(health: SensorHealth) -> str:
    return "; ".join(f"{fault.topic} {fault.fault}" for fault in health.faults)


REFLECTED: Final = (
    Reflected("battery", "battery_charge", float, _charge),
    Reflected("light", "darkness", float, _darkness),
    Reflected("sensor_health", "sensor_faults", str, _sensor_faults),
    Reflected("system_status", "problems", str, _problems),
)
"""Charge of the battery and darkness, both as ratios in [0, 1]; what is wrong with the sensors, and altogether."""


class SystemReflection:
    """Writes each new message once, so that a node that waits for an update sees none that is not one."""

    def __init__(self, inputs: Inputs, reflected: Sequence[Reflected]) -> None:
        """Read from a component's inputs."""
        self._inputs = inputs
        self._reflected = reflected
        self._written: dict[str, Any] = {}

    def declare(self, board: Blackboard) -> None:
        """Give a new root blackboard the entries, still empty; they are filled at the next `update`."""
        self._written.clear()
        for entry in self._reflected:
            board.declare(entry.key, entry.type)

    def update(self, board: Blackboard) -> None:
        """Write the entries whose input has something new."""
        for entry in self._reflected:
            message = self._inputs[entry.input].latest
            if message is not None and message is not self._written.get(entry.key):
                self._written[entry.key] = message
                board.set(entry.key, entry.read(message))
