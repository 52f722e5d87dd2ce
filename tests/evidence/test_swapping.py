"""Hundreds of swaps through the manager, at a thousand messages a second: nothing is lost, nothing is doubled."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome, SetParameters, Swap
from regraft.client import ClientGoal
from tests.handover.parts import Ask, Asked, Item
from tests.host.adapting.test_swap import HEAD, NOTHING, STACK, adapt, faults, hears_on
from tests.host.moves.moving import Moving
from tests.host.several import Site
from tests.support.machine.processes import children_of, exists, kill
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

pytestmark = [pytest.mark.evidence, pytest.mark.alone, pytest.mark.timeout(1800)]

SWAPS, FAULTS_INTERVAL = 300, 10
PATIENT = STACK.replace(", answer_within: 1.0, undo_within: 3.0, start_within: 10.0", "")
"""With the manager's usual bounds: the machine may be busy."""
CALLER = "  caller: {class: 'tests.handover.parts:Caller'}\n"
OFTEN = "    restart: {limit: 1000, window: 1, backoff: 0.01}\n"
GOOD = ("tests.handover.parts:Doubler", "tests.handover.parts:Totaller")
BAD = ("tests.handover.parts:DiesRestoring", "tests.handover.parts:HangsRestoring", "tests.handover.parts:Unable")


@pytest.fixture
def running(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[System]:
    """Return a source at 1 kHz, a totaller that is called 200 times a second, a sink that checks all, a manager."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    (tmp_path / "stack.yaml").write_text(HEAD + PATIENT + OFTEN + CALLER)
    system = System(tmp_path / "stack.yaml")
    for name in ("source", "totaller", "sink", "caller", "adaptation_manager"):
        system.wait_running(name)
    hears_on(system, 50)
    yield system
    processes = children_of(system.process.pid)
    system.end()
    assert not [pid for pid in processes if exists(pid)]


def _walk(system: System) -> ClientGoal[Item, Item]:
    return system.client.goal("walk", Ask(1_000_000), Item, Item)


def _end_of(system: System, goal: ClientGoal[Item, Item]) -> Item:
    """Have the walk come to its end, which it has gone on towards through every swap."""
    heard = goal.feedback
    wait_until(lambda: goal.feedback != heard, "the goal goes on")
    system.client.call("hurry", Ask(999_999), Item, PATIENCE)
    return goal.result(PATIENCE)


def _calls(system: System) -> Asked:
    """Return how the calls went, once all are answered."""
    adapt(system, SetParameters("caller", {"rate": 0.0}))

    def asked() -> Asked:
        return system.client.call("asked", Ask(), Asked, PATIENCE)

    wait_until(lambda: asked().answered == asked().asked, "all calls to be answered")
    return asked()


def test_three_hundred_swaps_lose_and_double_nothing_and_no_call_and_no_goal_fails(running: System) -> None:
    goal = _walk(running)
    for number in range(SWAPS):
        report = adapt(running, Swap("totaller", GOOD[number % 2]))
        assert report.outcome is Outcome.APPLIED, (report.outcome, report.error, report.steps)
    assert _end_of(running, goal) == Item(1_000_000)
    calls = _calls(running)
    assert (calls.failed, calls.miscounted, calls.strange) == (0, 0, 0)
    assert faults(running) == NOTHING


def test_successors_that_fail_and_killed_managers_in_between_change_nothing_of_that(running: System) -> None:
    goal = _walk(running)
    outcomes: Counter[Outcome] = Counter()
    for number in range(60):
        classes = (*GOOD, BAD[number // 3 % 3])
        report = _asked_through_a_death(running, number, classes[number % 3])
        outcomes[report.outcome] += 1
    assert outcomes.keys() == {Outcome.APPLIED, Outcome.ROLLED_BACK}, outcomes
    assert _end_of(running, goal) == Item(1_000_000)
    calls = _calls(running)
    assert (calls.failed, calls.miscounted, calls.strange) == (0, 0, 0)
    assert faults(running) == NOTHING


def test_thirty_swaps_lose_and_double_no_picture_at_30_hz(site: Site) -> None:
    moving = Moving(site, pictures=True)
    moving.wait_flowing()
    for _ in range(30):
        report = moving.adapt(Swap("totaller", "tests.host.moves.pictures:Looker"))
        assert report.outcome is Outcome.APPLIED, (report.outcome, report.error, report.steps)
        moving.hears_on()
    moving.check()
    viewed = moving.system.client.call("viewed", Ask(), Item, PATIENCE)
    assert viewed.number > 30
    assert viewed.total == 0, "a picture was lost, doubled or wrong"


def _asked_through_a_death(system: System, number: int, cls: str) -> AdaptationReport:
    """Swap; every tenth time the manager is killed as it begins, and its next run answers."""
    if number % FAULTS_INTERVAL == 0:
        pending = adapt(system, Swap("totaller", cls), key=f"swap {number}", wait=False)
        assert pending.outcome is Outcome.PENDING
        kill(system.wait_running("adaptation_manager").pid)
    return adapt(system, Swap("totaller", cls), key=f"swap {number}")
