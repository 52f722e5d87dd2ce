"""What stands after a move has failed: nothing is lost, and two runs never act."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import AdaptationReport, ChangeState, Move, Outcome, Swap
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.lifecycle import Transition
from tests.host.adapting.test_swap import faults
from tests.host.moves.moving import HOME, TO_EDGE, Moving
from tests.host.several import Site
from tests.support.hosts import wait_state
from tests.support.machine.processes import children_of, exists, kill, wait_gone
from tests.support.waiting import wait_until

pytestmark = pytest.mark.evidence

PARTS = "tests.handover.parts"
HERE = "tests.host.parts"


def _begin(site: Site, cls: str, at: str = "local", hosts: str = "") -> Moving:
    moving = Moving(site, cls, at, hosts)
    moving.join()
    moving.wait_flowing()
    return moving


def _as_before(moving: Moving, pid: int, host: str = "local") -> None:
    """Check that the process of before goes on, at its host, and that nobody missed anything."""
    after = moving.wait_alone(host)
    assert (after.pid, after.started_as) == (pid, 1)
    moving.check()


def _wait_log(host: str, text: str) -> None:
    """Wait until a run of the totaller on a host says something."""
    system = "tests" if host == "local" else f"tests@{host}"
    path = Path(os.environ["REGRAFT_HOME"]) / system / "logs" / "totaller.log"
    wait_until(lambda: path.exists() and text in path.read_text(), f"{text!r} on {host}")


# --- the successor ---


@pytest.mark.parametrize("cls", ["DiesRestoring", "HangsRestoring", "Unable"])
def test_a_successor_that_fails_on_the_other_host_is_not_missed(site: Site, cls: str) -> None:
    moving = _begin(site, f"{PARTS}:{cls}")
    before, elsewhere = moving.wait_alone("local"), children_of(site.guests[0].process.pid)
    for _ in range(2):
        report = moving.adapt(TO_EDGE)
        assert report.outcome is Outcome.ROLLED_BACK, report
        assert "totaller" in report.error
        _as_before(moving, before.pid)
        assert children_of(site.guests[0].process.pid) == elsewhere


def test_a_later_failure_gives_the_living_state_back_to_the_process_of_before(site: Site) -> None:
    moving = _begin(site, f"{PARTS}:Totaller")
    before = moving.wait_alone("local")
    report = moving.adapt(TO_EDGE, Swap("sink", f"{HERE}:LameSink"))
    assert report.outcome is Outcome.ROLLED_BACK, report
    _as_before(moving, before.pid)
    assert moving.adapt(TO_EDGE).outcome is Outcome.APPLIED
    there = moving.wait_alone("edge")
    moving.check()
    kill(there.pid)
    again = site.wait_active("totaller", there.incarnation)
    assert again == there.incarnation + 1
    assert site.host_of("totaller") == "edge"


# --- the incumbent ---


@pytest.mark.parametrize(("cls", "at"), [("DiesHandingOver", "local"), ("HangsHandingOver", "edge")])
def test_an_incumbent_that_is_lost_as_it_hands_over_costs_its_state_and_nothing_else(
    site: Site, cls: str, at: str
) -> None:
    moving = _begin(site, f"{PARTS}:{cls}", at)
    target = "edge" if at == "local" else "local"
    report = moving.adapt(Move("totaller", target))
    assert report.outcome is Outcome.APPLIED_STATE_LOST, report
    moving.wait_alone(target)
    moving.hears_on()


def test_an_incumbent_killed_while_its_successor_gets_ready_costs_its_state_and_nothing_else(site: Site) -> None:
    moving = _begin(site, f"{HERE}:SlowTotaller")
    before = moving.wait_alone("local")
    pending = moving.adapt(TO_EDGE, wait=False)
    _wait_log("edge", "gets ready")
    kill(before.pid)
    assert moving.ended(pending).outcome is Outcome.APPLIED_STATE_LOST
    moving.wait_alone("edge")
    moving.hears_on()


# --- the hosts ---


def _pending(moving: Moving, when: str) -> AdaptationReport:
    """Begin a move to edge, and wait until it is so far."""
    later = [ChangeState("sleeper", Transition.ACTIVATE)] if when == "later" else []
    pending = moving.adapt(TO_EDGE, *later, wait=False)
    if when == "ready":
        _wait_log("edge", "gets ready")
    elif when == "takes over":
        _wait_log("edge", "takes its time")
    else:
        wait_until(lambda: [at for at, speaks, _ in moving.runs() if speaks] == ["edge"], "the run on edge to speak")
    return pending


CLASSES = {"ready": "SlowTotaller", "takes over": "SlowTaking", "later": "SlowTotaller"}


@pytest.mark.parametrize("when", CLASSES)
def test_a_target_host_that_is_killed_is_not_missed(site: Site, when: str) -> None:
    moving = _begin(site, f"{HERE}:{CLASSES[when]}")
    before = moving.wait_alone("local")
    pending = _pending(moving, when)
    site.guests[0].process.kill()
    assert moving.ended(pending).outcome is Outcome.ROLLED_BACK
    _as_before(moving, before.pid)
    moving.join()
    assert moving.adapt(TO_EDGE).outcome is Outcome.APPLIED
    moving.wait_alone("edge")
    moving.check()


def test_a_source_host_that_is_killed_meanwhile_costs_the_state_and_nothing_else(site: Site) -> None:
    moving = _begin(site, f"{HERE}:SlowTotaller", "edge")
    pending = moving.adapt(HOME, wait=False)
    _wait_log("local", "gets ready")
    site.guests[0].process.kill()
    ended = moving.ended(pending)
    assert ended.outcome is Outcome.APPLIED_STATE_LOST, ended
    moving.wait_alone("local")
    moving.hears_on()


@pytest.mark.parametrize("when", ["takes over", "later"])
def test_a_source_host_that_is_killed_once_it_has_handed_over_is_not_missed(site: Site, when: str) -> None:
    moving = _begin(site, f"{HERE}:{CLASSES[when]}", "edge")
    later = [ChangeState("sleeper", Transition.ACTIVATE)] if when == "later" else []
    pending = moving.adapt(HOME, *later, wait=False)
    if when == "later":
        wait_until(lambda: [at for at, speaks, _ in moving.runs() if speaks] == ["local"], "the run here to speak")
    else:
        _wait_log("local", "takes its time")
    site.guests[0].process.kill()
    ended = moving.ended(pending)
    assert ended.outcome is Outcome.APPLIED, ended
    moving.wait_alone("local")
    moving.check(calls=False)


# --- the manager ---


@pytest.mark.parametrize("when", CLASSES)
def test_a_manager_killed_in_the_middle_undoes_the_move_on_its_return(site: Site, when: str) -> None:
    moving = _begin(site, f"{HERE}:{CLASSES[when]}")
    before = moving.wait_alone("local")
    pending = _pending(moving, when)
    kill(moving.system.wait_running("adaptation_manager").pid)
    assert moving.ended(pending).outcome is Outcome.ROLLED_BACK
    _as_before(moving, before.pid)
    assert moving.adapt(TO_EDGE).outcome is Outcome.APPLIED
    moving.wait_alone("edge")
    moving.check()


# --- a partition ---


@pytest.mark.parametrize("when", CLASSES)
def test_two_runs_never_act_when_the_link_to_the_target_is_cut(site: Site, when: str) -> None:
    moving = Moving(site, f"{HERE}:{CLASSES[when]}")
    link = site.link()
    guest = moving.join("edge", link.endpoint)
    moving.wait_flowing()
    before = moving.wait_alone("local")
    pending = _pending(moving, when)
    there = next(process.pid for at, _, process in moving.runs() if at == "edge")
    link.cut()
    assert moving.ended(pending).outcome is Outcome.ROLLED_BACK
    moving.hears_on()
    if when != "ready":  # it might have been told to speak
        assert not exists(there), "it has ended before the run of before has gone on"
    link.heal()
    wait_gone([there])
    after = moving.wait_alone("local")
    assert (after.pid, after.started_as) == (before.pid, 1)
    assert exists(guest.process.pid)
    wait_state(site.system, "edge", HostState.JOINED)
    again = moving.adapt(TO_EDGE)
    assert again.outcome is Outcome.APPLIED, again
    moving.wait_alone("edge")
    # A link that is cut in the middle of a stream may cost others messages: the bus waits for it, but not for long.
    _, doubled, disordered, _ = faults(moving.system)
    assert (doubled, disordered) == (0, 0)


def test_two_runs_never_act_when_the_link_to_the_source_is_cut(site: Site) -> None:
    moving = Moving(site, f"{HERE}:SlowTotaller", "edge")
    moving.join("edge", site.link().endpoint)
    moving.wait_flowing()
    there = moving.wait_alone("edge").pid
    pending = moving.adapt(HOME, wait=False)
    _wait_log("local", "gets ready")
    site.links[0].cut()
    assert moving.ended(pending).outcome is Outcome.APPLIED_STATE_LOST
    assert not exists(there), "it has ended before another goes on"
    moving.hears_on()
    site.links[0].heal()
    wait_state(site.system, "edge", HostState.JOINED)
    moving.wait_alone("local")
