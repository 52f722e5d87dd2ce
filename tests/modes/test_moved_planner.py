"""Under the real clock the mode planner moves, rests and dies while the laser fails again and again: rules continue."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.bus_schema.model.adaptation import (
    ADAPT,
    AdaptationReport,
    AdaptationRequest,
    Change,
    ChangeState,
    Move,
    Outcome,
)
from regraft.bus_schema.model.lifecycle import Transition
from tests.modes.stacks import REAL, write
from tests.support.hosts import JoinedHost
from tests.support.machine.processes import kill
from tests.support.systems import System, home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

PLANNER = "mode_planner"


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    folder = tmp_path_factory.mktemp("moved")
    with home(folder / "home"):
        made = System(write(folder, REAL.replace("clock: real\n", "clock: real\nhosts: [edge]\n")))
        edge = JoinedHost(made.info.endpoint, "edge", folder / "edge.log")
        edge.wait_joined(made)
        made.wait_running(PLANNER)
        yield made
        made.end()
        edge.ended()


def _adapt(system: System, *changes: Change) -> None:
    report = system.client.call(ADAPT, AdaptationRequest(changes), AdaptationReport, PATIENCE)
    assert report.outcome is Outcome.APPLIED, report


def _entered(system: System, rule: str = "") -> int:
    """Return how often rules, or one of them, have entered a mode."""
    applied = system.said("adaptation.applied", "adaptation_manager")
    return len([event for event in applied if f"(rule {rule}" in event.text])


def _wait_for_next(system: System, rule: str) -> None:
    before = _entered(system, rule)
    wait_until(lambda: _entered(system, rule) > before, f"rule {rule} to enter its mode")


def _faults(system: System) -> tuple[int, int]:
    """Return how often the laser has failed, and has recovered."""
    return len(system.said("component.failed", "laser")), len(system.said("component.recovered", "laser"))


def _continue(system: System) -> None:
    """Wait until both rules have entered their modes from now on; none was taken for a manual one."""
    before = _entered(system, "degrade"), _entered(system, "recover")
    wait_until(lambda: _entered(system, "degrade") > before[0], "the degraded mode")
    wait_until(lambda: _entered(system, "recover") > before[1], "the normal mode")
    assert not system.said("modes.manual", PLANNER)


@pytest.mark.parametrize("host", ["edge", "local"])
def test_rules_continue_on_another_host(system: System, host: str) -> None:
    _wait_for_next(system, "recover")
    _adapt(system, Move(PLANNER, host))
    wait_until(lambda: system.client.components()[PLANNER].host == host, f"the report of {host}")
    _continue(system)


def test_a_failure_that_it_misses_while_it_is_inactive_it_sees_on_its_return(system: System) -> None:
    _wait_for_next(system, "recover")
    failures, _ = _faults(system)
    _adapt(system, ChangeState(PLANNER, Transition.DEACTIVATE))
    wait_until(lambda: _faults(system)[0] > failures, "a failure")
    _adapt(system, ChangeState(PLANNER, Transition.ACTIVATE))
    _continue(system)


def test_the_end_of_a_failure_that_it_misses_while_it_is_inactive_it_sees_on_its_return(system: System) -> None:
    _wait_for_next(system, "degrade")
    _adapt(system, ChangeState(PLANNER, Transition.DEACTIVATE))
    wait_until(lambda: len(set(_faults(system))) == 1, "the end of the failure")
    _adapt(system, ChangeState(PLANNER, Transition.ACTIVATE))
    _continue(system)


@pytest.mark.parametrize("rule", ["recover", "degrade"])
def test_rules_continue_after_its_death(system: System, rule: str) -> None:
    process = system.wait_running(PLANNER)
    _wait_for_next(system, rule)
    kill(process.pid)
    system.wait_running(PLANNER, process.incarnation + 1)
    _continue(system)
