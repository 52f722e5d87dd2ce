"""Test equipment: an observer, and a system whose states, faults, sensors and measurements the test makes up."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from regraft import Component, State
from regraft.bus_schema.messages.health import Diagnostic, SensorFault, SensorHealth
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.management.system import (
    ComponentState,
    SystemFault,
    SystemFaultKind,
    SystemFaults,
    SystemMeasurements,
    SystemStates,
)
from regraft.testing import Rig

OBSERVED = "modes_observer:\n  ros__parameters:\n    components:\n      camera\n      laser\n"


@dataclass
class Scene:
    """The system that an observer sees, and the diagnostics that it has published."""

    rig: Rig
    diagnostics: list[Diagnostic]
    states: dict[str, State | None] = field(default_factory=lambda: {"camera": State.ACTIVE, "laser": State.ACTIVE})
    runs: dict[str, int] = field(default_factory=dict)
    faults: dict[str, SystemFaultKind] = field(default_factory=dict)
    sensors: dict[str, str] = field(default_factory=dict)
    has_monitor: bool = False
    measured: dict[str, dict[str, float]] = field(default_factory=dict)
    measured_at: float | None = None
    failed_at: dict[tuple[str, SystemFaultKind], float] = field(default_factory=dict)

    def publish(self) -> None:
        """Publish how all of it is."""
        now = self.rig.clock.now() / 1e9
        components = tuple(ComponentState(name, self.runs.get(name, 1), state) for name, state in self.states.items())
        self.rig.publish("system/states", SystemStates(now, components))
        self.failed_at = {fault: self.failed_at.get(fault, now) for fault in self.faults.items()}
        present = tuple(SystemFault(stamp, name, 1, kind, "why") for (name, kind), stamp in self.failed_at.items())
        self.rig.publish("system/faults", SystemFaults(now, present))
        stamp = now if self.measured_at is None else self.measured_at
        values = tuple(MeasuredQualities(stamp, name, 1, 0.5, each) for name, each in self.measured.items())
        self.rig.publish("system/measurements", SystemMeasurements(now, values))

    def fail_again(self) -> None:
        """Have all faults begin again."""
        self.failed_at.clear()

    def watch(self) -> None:
        """Publish how the sensors are."""
        now = self.rig.clock.now() / 1e9
        faults = tuple(SensorFault(topic, fault, "why", now) for topic, fault in self.sensors.items())
        self.rig.publish("sensor_health", SensorHealth(now, ("picture", "scan"), faults))

    def run(self, seconds: float) -> None:
        """Let time pass, in which the system is as it is."""
        for _ in range(round(seconds / 0.5)):
            self.publish()
            if self.has_monitor:
                self.watch()
            self.rig.advance(0.5)

    def news(self) -> list[tuple[str, str, dict[str, Any]]]:
        """Return level, text and values of the diagnostics since the last call."""
        found = [(each.level.value, each.text, each.values) for each in self.diagnostics]
        self.diagnostics.clear()
        return found

    def statuses(self) -> list[tuple[str, str]]:
        """Return components and statuses since the last call."""
        return [(name, str(value)) for _, _, values in self.news() for name, value in values.items()]


@contextmanager
def scene(observer: type[Component], **parameters: Any) -> Iterator[Scene]:
    """Give an observer in a system where all is well."""
    with Rig() as rig:
        made = Scene(rig, rig.collect("diagnostics", Diagnostic))
        rig.add(observer, "observer", parameters)
        yield made


def written(folder: Path, text: str = OBSERVED) -> str:
    """Return the path of a file with the text."""
    file = folder / "observed.yaml"
    file.write_text(text)
    return str(file)
