"""Under simulated time what is reflected, and when, is the same in every run."""

from __future__ import annotations

from typing import Any

from regraft import Component, Input
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.mission import MissionStatus
from regraft.bus_schema.messages.reflection import ReflectedEntries
from regraft.bus_schema.model.lifecycle import State
from regraft.services.bt_executor.executor import Executor
from regraft.services.system_reflection import SystemReflection
from tests.executor.helpers import tree
from tests.reflection.parts import Battery, Wheels
from tests.stepped.parts import TinyWorld
from tests.support.stepped.step_site import StepSite

MAPPING: list[dict[str, Any]] = [
    {"topic": "odometry", "field": "twist.linear.x", "entry": "speed", "rate": 10, "stale_after": 0.3},
    {"topic": "battery", "field": "charge", "entry": "charge", "rate": 3},
]
SECONDS = 20.0


class Witness(Component):
    """Keeps all that is reflected, and the missions' blackboards."""

    reflection = Input(ReflectedEntries)
    mission = Input(MissionStatus)

    def __init__(self) -> None:
        self.reflected: list[ReflectedEntries] = []
        self.boards: list[dict[str, PlainValue]] = []

    @reflection.handler
    def take(self, message: ReflectedEntries) -> None:
        """Keep it."""
        self.reflected.append(message)

    @mission.handler
    def look(self, status: MissionStatus) -> None:
        """Keep the blackboard."""
        self.boards.append(status.blackboard)


def run_in_step(file: str) -> tuple[list[ReflectedEntries], list[dict[str, PlainValue]]]:
    """Run for a while of simulated time; returns what was reflected and the blackboards."""
    steps = StepSite("memory")
    try:
        steps.start(Battery, "battery", parameters={"rate": 7.0}, state=State.ACTIVE)
        steps.start(Wheels, "wheels", state=State.ACTIVE)
        steps.start(SystemReflection, "system_reflection", parameters={"mapping": MAPPING}, state=State.ACTIVE)
        steps.start(Executor, "bt_executor", parameters={"mission": file}, state=State.ACTIVE)
        steps.start(Witness, "witness", state=State.ACTIVE)
        members = ("battery", "bt_executor", "system_reflection", "wheels", "witness")
        steps.start_world(TinyWorld, members, SECONDS)
        assert steps.wait_finished().reproducible
        witness = steps.component("witness")
        return witness.reflected, witness.boards
    finally:
        steps.close()


def test_equal_runs_reflect_the_same_at_the_same_times(tmp_path: Any) -> None:
    file = tmp_path / "mission.xml"
    file.write_text(tree('<Sleep msec="1000000"/>'))
    reflected, boards = run_in_step(str(file))
    assert len(reflected) >= 10 * (SECONDS - 1)
    last = boards[-1]
    assert last["speed"] == 0.2
    assert 0.0 < float(str(last["charge_age"])) < 0.6
    assert last["speed_stale"] is False
    assert (reflected, boards) == run_in_step(str(file))
