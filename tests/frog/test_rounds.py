"""FROG makes its rounds under requirements, with real processes, and outlives those that help it adapt."""

from __future__ import annotations

from typing import Any

import pytest

from regraft.bus_schema.messages.quality import Quality
from tests.frog.conftest import StartFrog
from tests.support.frog import Frog
from tests.support.machine.processes import kill
from tests.support.paths import FROG
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

ROUNDS = FROG / "rounds.yaml"
REQUIREMENTS = [
    "MoveSafely", "MoveQuickly", "MovePowerEfficiently", "DetectPowerEfficiently", "DetectEffectively",
]  # fmt: skip


def mission(frog: Frog) -> dict[str, Any]:
    """Return the mission as REST has it."""
    found: dict[str, Any] = frog.rest.get("/mission").json()
    return found


def adaptations(frog: Frog, by: str) -> list[dict[str, Any]]:
    """Return the applied adaptations of a decorator, as REST has them, newest first."""
    lines = frog.rest.get("/adaptations").json()["entries"]
    return [line for line in lines if line["outcome"] == "applied" and by in line["request"]["actor"]]


def kill_running(frog: Frog, name: str) -> None:
    """Kill a component and wait until it is back."""
    kill(frog.wait_running(name).pid)
    frog.wait_running(name, 2)
    wait_until(lambda: frog.states() == {"active"}, f"everybody active after the death of {name}")


def test_requirements_are_told_and_adapted_for_and_a_dead_reflection_stops_nothing(start_frog: StartFrog) -> None:
    frog = start_frog("--speed", "max", stack=ROUNDS)
    told: list[Quality] = []
    frog.client.requirements(told.append)
    wait_until(lambda: adaptations(frog, "AdjustMaxVelocity"), "the speed to be adapted", 60.0)
    seen = mission(frog)
    assert [quality["requirement"] for quality in seen["qualities"]] == REQUIREMENTS
    wait_until(lambda: {quality.requirement for quality in told} == set(REQUIREMENTS), "word of all requirements")
    (context, *_) = [line["request"]["context"] for line in adaptations(frog, "AdjustMaxVelocity")]
    assert "AdjustMaxVelocity" in context["node"]
    assert {"MoveSafely", "MovePowerEfficiently"} <= set(context["qualities"])

    kill_running(frog, "system_reflection")
    since = frog.clock().time
    frog.wait_for_time_after(since, 5.0)
    assert mission(frog)["state"] == "running"
    known = [quality for quality in told if quality.stamp > since / 1e9 and quality.requirement == "MoveSafely"]
    assert any(quality.satisfied is not None for quality in known)


def test_a_strategy_adapts_the_speed_and_the_rounds_go_on_when_its_planner_dies(start_frog: StartFrog) -> None:
    external = FROG / "missions" / "rounds_external.xml"
    frog = start_frog("--speed", "max", "--set", f"bt_executor.mission={external}", stack=ROUNDS)
    wait_until(lambda: adaptations(frog, "bandits"), "the strategy to choose", 60.0)
    kill_running(frog, "bandits")
    before = frog.clock().time / 1e9
    frog.wait_for_time(5.0)
    assert mission(frog)["state"] == "running"
    wait_until(
        lambda: adaptations(frog, "bandits")[0]["started"] > before, "the strategy to choose again", 60.0
    )  # fmt: skip
