"""The system's view of itself, for missions and people."""

from __future__ import annotations

from collections import Counter

from regraft import Component, Input, Output, Parameter, every
from regraft.bus_schema.messages.health import SensorHealth, SystemStatus
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Resources


class SystemStatusReporter(Component):
    """Summarizes what the parts publish: components by state, charge, darkness, and what is wrong.

    Components are counted by the state that the architecture wants for them. A value older than ``stale_after`` is
    unknown. That is a problem if its input has a topic.
    """

    resources = Resources(cpu=0.01, memory=20.0)

    low = Parameter(0.2, "charge below which there is a problem", minimum=0.0, maximum=1.0)
    dark = Parameter(0.7, "darkness above which there is a problem", minimum=0.0, maximum=1.0)
    stale_after = Parameter(3.0, "how long a value holds", minimum=0.1, unit="s")

    battery = Input(BatteryState, latest_only=True, required=False)
    light = Input(LightLevel, latest_only=True, required=False)
    sensor_health = Input(SensorHealth, latest_only=True, required=False, description="what is wrong with the sensors")
    architecture = Input(Architecture, latest_only=True, required=False, description="which components there are")
    system_status = Output(SystemStatus, description="the system in one line")

    @every(hz=1.0)
    def tell(self) -> None:
        """Publish the status."""
        now = self.kit.now()
        battery, light = self.battery.latest, self.light.latest
        problems = []
        charge = darkness = None
        if battery is not None and now - battery.stamp <= self.stale_after:
            charge = battery.charge
            if charge < self.low:
                problems.append(f"battery at {charge:.0%}")
        elif battery is not None and self.battery.key:
            problems.append(f"no word from the battery for {now - battery.stamp:.0f} s")
        if light is not None and now - light.stamp <= self.stale_after:
            darkness = light.darkness
            if darkness > self.dark:
                problems.append(f"darkness {darkness:.0%}")
        elif light is not None and self.light.key:
            problems.append(f"no word of the light for {now - light.stamp:.0f} s")
        problems += self._sensor_problems(now)
        self.system_status.publish(SystemStatus(now, self._components(), charge, darkness, tuple(problems)))

    def _sensor_problems(self, now: float) -> list[str]:
        health = self.sensor_health.latest
        if health is None:
            return []
        if now - health.stamp > self.stale_after:
            silence = f"no word of the sensors for {now - health.stamp:.0f} s"
            return [silence] if self.sensor_health.key else []
        return [f"{fault.topic} {fault.fault}" for fault in health.faults]

    def _components(self) -> dict[str, int]:
        wanted = self.architecture.latest
        if wanted is None:
            return {}
        return dict(sorted(Counter(spec.state.value for spec in wanted.components.values()).items()))
