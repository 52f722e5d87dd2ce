"""One of two robots is changed and broken while it works: the other does not notice."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.mission import MissionStatus
from regraft.bus_schema.messages.world import GroundTruth
from tests.frog.conftest import StartFrog
from tests.support.frog import Frog
from tests.support.machine.processes import kill
from tests.support.paths import TWO_ROBOTS
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow

SECONDS = 16
ROWS = {"scout/ground_truth": GroundTruth, "scout/velocity": Twist, "scout/mission": MissionStatus}
Row = tuple[int, dict[str, Any]]


class Told:
    """A run's report of the scout: its rows by topic and number, and the summary of the whole run."""

    def __init__(self, frog: Frog, log: Path, meanwhile: Callable[[Frog], None]) -> None:
        self.rows: dict[str, dict[int, Row]] = {topic: {} for topic in ROWS}
        for topic, cls in ROWS.items():
            frog.client.topic(topic, cls, partial(self._note, self.rows[topic]))
        meanwhile(frog)
        assert frog.process.wait(SECONDS + 2 * PATIENCE) == 0
        said = log.read_text()
        self.summary = json.loads(said[said.index("{") :])

    @staticmethod
    def _note(rows: dict[int, Row], sample: Any) -> None:
        rows[sample.sequence] = sample.stamp, codec.to_plain(sample.message)

    def of_scout(self) -> dict[str, Any]:
        """Return what the scout's recorder says: its digest covers every tick from the first."""
        found: dict[str, Any] = self.summary["summaries"]["scout.recorder"]
        return found


def broken_swapped_and_rewired(frog: Frog) -> None:
    """Kill the rescuer's battery, rewire it to the other robot and back, and swap it."""
    killed = frog.wait_running("rescuer.battery")
    kill(killed.pid)
    frog.wait_running("rescuer.battery", killed.incarnation + 1)
    for topic in ("scout/odometry", "rescuer/odometry"):
        rewired = {"change": "connect", "component": "rescuer.battery", "port": "odometry", "topic": topic}
        assert frog.adapt(rewired).status_code == 200
    swapped = {"change": "swap", "component": "rescuer.battery", "parameters": {"capacity": 5000.0}}
    assert frog.adapt(swapped).status_code == 200


def test_a_robot_goes_on_to_the_byte_while_a_component_of_the_other_dies_is_swapped_and_rewired(
    tmp_path: Path, start_frog: StartFrog
) -> None:
    runs = []
    for meanwhile in (broken_swapped_and_rewired, lambda frog: None):
        frog = start_frog("--speed", "real", "--for", str(SECONDS), "--json", stack=TWO_ROBOTS)
        runs.append(Told(frog, tmp_path / "up.log", meanwhile))
    disturbed, calm = runs
    assert (disturbed.summary["restarts"], calm.summary["restarts"]) == (1, 0)
    assert (disturbed.summary["adaptations"], calm.summary["adaptations"]) == ({"applied": 5}, {"applied": 2})
    assert disturbed.of_scout() == calm.of_scout()
    for topic in ROWS:
        common = disturbed.rows[topic].keys() & calm.rows[topic].keys()
        assert len(common) >= 0.1 * max(calm.rows[topic]), topic
        assert [disturbed.rows[topic][n] for n in sorted(common)] == [calm.rows[topic][n] for n in sorted(common)]
