"""Planners take decisions by faults and requirements in the tick in which these come and go, equally in every run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.faults.stacks import STACK, write
from tests.support.commands import in_home, run

pytestmark = pytest.mark.slow

CLASSES = {
    "forecast": "regraft.adaptation_manager.planners.forecast.forecast_planner:ForecastPlanner",
    "bandits": "regraft.adaptation_manager.planners.bandits.bandit_planner:BanditPlanner",
}
HAND = """\
context:
  lost: {fault: driver}
choices:
  hand:
    alternatives:
      driver: {set: {component: spare, state: inactive}, figures: {worth: 1}}
      spare: {set: {component: spare, state: active}, figures: {worth: 0.5}}
objective: {utility: total.worth}
faults:
  driverless: {when: lost, excludes: {hand: driver}}
triggers: {on_fault: true}
"""
PACE = """\
context:
  steady: {requirement: Steady}
choices:
  gain:
    alternatives:
      soft: {set: {component: driver, parameter: gain, value: 0.5}, figures: {worth: 0.5}}
      hard: {set: {component: driver, parameter: gain, value: 1.0}, figures: {worth: 1}}
objective: {utility: total.worth}
faults:
  shaky: {when: not steady, excludes: {gain: hard}}
triggers: {on_requirement: [Steady]}
"""


def _run(folder: Path, decision: str, *faults: str, planner: str = "forecast") -> dict[str, Any]:
    folder.mkdir()
    (folder / "decisions").mkdir()
    (folder / "decisions" / "taken.yaml").write_text(decision)
    text = STACK.replace("  decider: {class: 'tests.faults.parts:Decider'}\n", "").replace(
        "tests.faults.parts:Summary", "tests.faults.ledger:Ledger"
    )
    text += f"  judge: {{class: 'tests.faults.ledger:Judge'}}\n  {planner}:\n    class: {CLASSES[planner]}\n"
    stack = write(folder, text + "    parameters: {decisions: decisions}\n")
    options = [word for fault in faults for word in ("--fault", fault)]
    done = run("up", str(stack), "--headless", "--json", "--for", "7", *options, environment=in_home(folder / "home"))
    assert done.stdout, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def _agree(folder: Path, decision: str, *faults: str, times: int, planner: str = "forecast") -> dict[str, Any]:
    """Run it so many times; return what all runs say."""
    runs = [_run(folder / str(number), decision, *faults, planner=planner) for number in range(times)]
    assert all(found["reproducible"] for found in runs), runs
    assert len({found["digest"] for found in runs}) == 1, runs
    return runs[0]


@pytest.fixture(params=[1, pytest.param(5, marks=pytest.mark.evidence)])
def times(request: pytest.FixtureRequest) -> int:
    """Return how many runs are compared."""
    count: int = request.param
    return count


def _activations(found: dict[str, Any]) -> list[str]:
    return sorted((what for what in found["visits"] if what.startswith("spare.")), key=lambda what: what.split()[-1])


def test_what_has_failed_is_left_in_its_tick_and_taken_again_when_it_is_back(tmp_path: Path, times: int) -> None:
    found = _agree(tmp_path, HAND, "1 driver kill", "3 driver stop", "5 driver hang", times=times)
    assert _activations(found) == [
        f"spare.{transition} at {second + delay:.2f}"
        for second in (1, 3, 5)
        for transition, delay in (("activate", 0.05), ("deactivate", 0.55))
    ]
    assert found["visits"]["driver.recovered"] == 3


def test_the_bandits_leave_what_has_failed_in_the_same_tick(tmp_path: Path, times: int) -> None:
    found = _agree(tmp_path, HAND, "2 driver kill", planner="bandits", times=times)
    assert _activations(found)[0] == "spare.activate at 2.05"


def test_what_is_quarantined_stays_excluded(tmp_path: Path, times: int) -> None:
    found = _agree(tmp_path, HAND, *(f"{second} driver kill" for second in range(1, 7)), times=times)
    assert found["visits"]["driver.quarantined"] == 1
    assert _activations(found)[-1].startswith("spare.activate")


def test_faults_of_which_a_decision_does_not_speak_are_no_reason_to_decide(tmp_path: Path, times: int) -> None:
    assert _activations(_agree(tmp_path, HAND, "2 judge kill", "3 driver exception", times=times)) == []


@pytest.mark.parametrize("times", [2])
def test_a_requirement_is_decided_upon_in_the_tick_in_which_it_turns(tmp_path: Path, times: int) -> None:
    visits = _agree(tmp_path, PACE, times=times)["visits"]
    assert [what for what in visits if what.startswith("driver {")] == [
        "driver {'gain': 0.5} at 3.00",
        "driver {'gain': 1.0} at 4.00",
    ]
