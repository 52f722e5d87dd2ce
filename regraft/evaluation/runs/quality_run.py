"""Runs a mission under requirements once, and writes down their reports."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.model.adaptation import AdaptationReport
from regraft.bus_schema.model.architecture import Architecture
from regraft.client import Client, TopicSample
from regraft.evaluation.runs.stack_run import RunFailed, running, started

SPEED = ("navigator", "max_velocity")
CAMERA = ("detector", "image")
"""The settings followed through the run: a component and its parameter, a component and its port."""
STALLED_TIMEOUT = 20.0
"""Wall-clock seconds that a simulated one may take at the most."""


@dataclass(slots=True)
class QualityRun:
    """The reports of a run of ``seconds``.

    ``qualities`` are in the order of their reports. ``darkness``, ``speed`` (the maximum velocity in m/s) and
    ``camera`` (the topic of the pictures) hold (s, value): from when on a value holds. ``closing`` is the closing line
    of ``regraft up``.
    """

    mission: str
    seconds: float
    qualities: list[Quality] = field(default_factory=list)
    adaptations: list[AdaptationReport] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    darkness: list[tuple[float, float]] = field(default_factory=list)
    speed: list[tuple[float, float]] = field(default_factory=list)
    camera: list[tuple[float, str]] = field(default_factory=list)
    closing: dict[str, Any] = field(default_factory=dict)

    def follow(self, sample: TopicSample) -> None:
        """Take in an architecture: how fast the robot may be, and where its pictures come from."""
        architecture: Architecture = sample.message
        now = sample.stamp / 1e9
        (driver, parameter), (looker, port) = SPEED, CAMERA
        specs = architecture.components
        if driver in specs:
            value = specs[driver].parameters.get(parameter)
            description = specs[driver].description
            if value is None and description is not None:
                value = next(p.default for p in description.parameters if p.name == parameter)
            if value is not None:
                _note(self.speed, now, float(value))
        if looker in specs and port in specs[looker].connections:
            _note(self.camera, now, specs[looker].connections[port])


def _note(values: list[tuple[float, Any]], now: float, value: Any) -> None:
    if not values or values[-1][1] != value:
        values.append((now, value))


def run_mission(
    stack: Path, mission: Path, seed: int, seconds: float, home: Path, options: tuple[str, ...] = ()
) -> QualityRun:
    """Run a stack with the tree in ``mission`` at full speed for simulated seconds.

    ``home`` takes the run's files; ``options`` go to ``regraft up``.

    Raises:
        RunFailed: it did not come up, or did not come to its end.
    """
    run = QualityRun(mission.stem, seconds)
    tree = ("--set", f"bt_executor.mission={mission.resolve()}")
    with (
        running(stack, seed, home, ("--for", f"{seconds:g}", *tree, *options)) as process,
        Client.connect(started(process, home)) as client,
    ):
        _listen(client, run)
        try:
            said, _ = process.communicate(timeout=60.0 + STALLED_TIMEOUT * seconds)
        except subprocess.TimeoutExpired:
            raise RunFailed(f"it did not come to its end, see {home / 'up.log'}") from None
    run.closing = json.loads(said) if said.strip() else {}
    if process.returncode:
        why = "; ".join(run.closing.get("problems", ())) or f"see {home / 'up.log'}"
        raise RunFailed(f"it ended with exit code {process.returncode}: {why}")
    return _until_the_end(run)


def _listen(client: Client, run: QualityRun) -> None:
    client.requirements(run.qualities.append)
    client.events(run.events.append)
    client.topic("architecture", Architecture, run.follow)
    client.topic("adaptations", AdaptationReport, lambda sample: run.adaptations.append(sample.message))
    client.topic("light", LightLevel, lambda s: run.darkness.append((s.message.stamp, s.message.darkness)))


def _until_the_end(run: QualityRun) -> QualityRun:
    """Leave out what is published when the parts end, which the client may or may not receive."""
    run.qualities = [quality for quality in run.qualities if quality.stamp < run.seconds]
    run.events = [event for event in run.events if event.stamp < run.seconds]
    return run
