"""SUAVE's monitors, with schedules in place of a vehicle: visibility of the water, thrusters, battery.

Each publishes diagnostics as the node of its name does in SUAVE's package ``suave_monitor`` (1.5.0), once a second.
Times count from the activation, as SUAVE's from its mode GUIDED.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final

from regraft import Component, Level, Output, Parameter, Records, every, service
from regraft.bus_schema.annotations import Bounds, Seconds
from regraft.bus_schema.messages.health import Diagnostic
from regraft.bus_schema.messages.management.objectives import COMPONENT_STATUS, QUALITY_STATUS
from regraft.stacks.suave.messages import BatteryLevel, Recharge, Recharged

THRUSTERS: Final = 6
FAILED, RECOVERED = "FALSE", "RECOVERED"
"""Words of MROS2 for a component's status."""
EVERY: Final = ""
"""The subject of a quality that is one of all objectives."""


def visibility(elapsed: float, lowest: float, highest: float, period: float, shift: float = 0.0) -> float:
    """Return how far one sees in the water (m) so many seconds after the start: a cosine, from the highest on.

    >>> [visibility(elapsed, 1.25, 3.75, 80.0) for elapsed in (0.0, 20.0, 40.0)]
    [3.75, 2.5, 1.25]
    """
    amplitude = (highest - lowest) / 2.0
    # Rounding keeps the zeros of the cosine from adding 1e-16: thresholds are compared with these values.
    return round(amplitude * math.cos(2.0 * math.pi / period * (elapsed + shift)) + amplitude + lowest, 12)


def thruster_name(number: int) -> str:
    """Return the component that a thruster is."""
    return f"c_thruster_{number}"


@dataclass(frozen=True, slots=True)
class ThrusterEvent:
    """A failure, or a recovery, of a thruster so many seconds after the start."""

    thruster: Annotated[int, Bounds(1, THRUSTERS)]
    at: Seconds
    failure: bool = True


class WaterVisibilityObserver(Component):
    """Publishes the visibility of the water: a cosine of whole seconds."""

    qa_publishing_period = Parameter(1.0, "time between two measurements", minimum=0.1, maximum=60.0, unit="s")
    water_visibility_period = Parameter(80.0, "period of the cosine", minimum=1.0, maximum=86_400.0, unit="s")
    water_visibility_min = Parameter(1.25, "lowest visibility", minimum=0.0, maximum=100.0, unit="m")
    water_visibility_max = Parameter(3.75, "highest visibility", minimum=0.0, maximum=100.0, unit="m")
    water_visibility_sec_shift = Parameter(0.0, "time by which the cosine is ahead", minimum=0.0, unit="s")

    diagnostics = Output(Diagnostic, description="the quality water_visibility")

    def on_activate(self) -> None:
        """Begin with the cosine."""
        self._began = self.kit.now()

    @every(seconds=qa_publishing_period)
    def measure(self) -> None:
        """Publish how far one sees."""
        now = self.kit.now()
        value = visibility(
            math.floor(now - self._began),
            self.water_visibility_min,
            self.water_visibility_max,
            self.water_visibility_period,
            self.water_visibility_sec_shift,
        )
        name = "water_visibility"
        self.diagnostics.publish(Diagnostic(now, self.kit.name, EVERY, Level.OK, QUALITY_STATUS, {name: value}))


class ThrusterMonitor(Component):
    """Publishes failures and recoveries of thrusters by its schedule."""

    thruster_events = Records(ThrusterEvent, "which thruster fails or recovers, and when, in this order")

    diagnostics = Output(Diagnostic, description="the statuses of thrusters")

    def on_activate(self) -> None:
        """Begin with the schedule."""
        self._began = self.kit.now()
        self._left = list(self.thruster_events)

    @every(seconds=1.0)
    def look(self) -> None:
        """Publish the next event if it is due: one at a time, as SUAVE's does."""
        now = self.kit.now()
        if not self._left or now - self._began < self._left[0].at:
            return
        event = self._left.pop(0)
        name, status = thruster_name(event.thruster), FAILED if event.failure else RECOVERED
        level = Level.ERROR if event.failure else Level.OK
        self.diagnostics.publish(Diagnostic(now, self.kit.name, name, level, COMPONENT_STATUS, {name: status}))


class BatteryMonitor(Component):
    """Publishes the charge of the battery, which falls steadily, and fills it when it is asked to."""

    qa_publishing_period = Parameter(1.0, "time between two measurements", minimum=0.1, maximum=60.0, unit="s")
    discharge_time = Parameter(200.0, "time in which a full battery is empty", minimum=1.0, unit="s")

    diagnostics = Output(Diagnostic, description="the quality battery_level")
    battery_level = Output(BatteryLevel, description="the same for the mission")

    def on_activate(self) -> None:
        """Begin with a full battery."""
        self._level, self._measured = 1.0, self.kit.now()

    @every(seconds=qa_publishing_period)
    def measure(self) -> None:
        """Take what was used since the last time, and publish what is left."""
        now = self.kit.now()
        self._level = max(0.0, round(self._level - (now - self._measured) / self.discharge_time, 12))
        self._measured = now
        self._publish()

    @service("battery_monitor/recharge")
    def recharge(self, request: Recharge) -> Recharged:
        """Fill the battery."""
        self._level = 1.0
        self._publish()
        return Recharged(self._level)

    def _publish(self) -> None:
        now, name = self.kit.now(), "battery_level"
        self.diagnostics.publish(Diagnostic(now, self.kit.name, EVERY, Level.OK, QUALITY_STATUS, {name: self._level}))
        self.battery_level.publish(BatteryLevel(now, self._level))
