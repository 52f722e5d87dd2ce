"""Hosts that are lost, cut off or frozen, tried on real processes joined by real links."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft.bus_schema.messages.management.manager import CancelAdaptation
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Add,
    Change,
    Move,
    Outcome,
    Remove,
    SetParameters,
    Swap,
    UnreachedCode,
)
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.lifecycle import State
from regraft.client import NoAnswer
from tests.host.several import MOVE, TICKER, WAIT, Site
from tests.support.hosts import JoinedHost, state_of, wait_state
from tests.support.links import Link
from tests.support.machine.processes import children_of, exists, go_on, kill, stop, wait_gone
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow


def test_a_lost_host_is_seen_and_its_components_are_reported(site: Site) -> None:
    system = site.up()
    guest = site.join()
    first = site.wait_active("ticker")
    pids = children_of(guest.process.pid)
    guest.process.kill()
    wait_gone(pids)
    wait_state(system, "edge", HostState.LOST)
    seen = system.client.components()["ticker"]
    assert not seen.alive
    assert seen.process is not None
    assert (seen.process.state, seen.process.exit_reason) == (ProcessState.LOST, "its host is lost")
    assert "and with it ticker" in system.said("host.silent", "edge")[0].text
    assert "wait for its return" in system.said("host.lost", "edge")[0].text
    refused = site.adapt(Add("second", ComponentSpec(cls="tests.host.parts:Moody", host="edge")))
    assert "host 'edge' is lost" in refused.violations[0].problem
    site.join()
    assert site.wait_active("ticker", first) > first + 1


def test_components_of_a_lost_host_start_elsewhere_if_the_stack_says_so(site: Site) -> None:
    system = site.up(hosts=MOVE)
    guest = site.join()
    first = site.wait_active("ticker")
    wait_until(lambda: site.snapshot("ticker")["count"] > 50, "some ticks")
    before = site.snapshot("ticker")["count"]
    guest.process.kill()
    assert site.wait_active("ticker", first) > first + 1
    assert site.host_of("ticker") == "local"
    assert site.snapshot("ticker")["count"] >= before - 10, "it goes on from its last checkpoint"
    wait_until(lambda: site.journal()[0].request.reason == "host 'edge' is lost", "the line of the journal")
    line = site.journal()[0]
    assert line.outcome is Outcome.APPLIED_STATE_LOST
    assert line.request.changes == (Move("ticker", "local"),)

    kill(site.pid("ticker"))
    site.wait_active("ticker", first + 1001)
    site.join()
    wait_until(lambda: state_of(system, "edge") is HostState.JOINED, "edge to be back")
    assert site.host_of("ticker") == "local", "it stays where it is now"


def test_a_host_that_fails_does_not_leave_in_good_order(site: Site) -> None:
    system = site.up(hosts=MOVE)
    guest = site.join()
    first = site.wait_active("ticker")
    kill(children_of(guest.process.pid)[0])
    site.wait_active("ticker", first)
    assert site.host_of("ticker") == "local"
    assert system.said("host.lost", "edge")
    assert not system.said("host.left", "edge")


def test_a_host_that_is_back_while_its_components_start_elsewhere_runs_none_of_them(site: Site) -> None:
    sleeper = "class: 'tests.host.parts:Sleeper', host: edge, parameters: {where: configure, seconds: 4.0}"
    system = site.up(f"{TICKER}  early: {{{sleeper}, limits: {{handler_timeout: 6.0}}}}\n", MOVE)
    link = site.link()
    guest = site.join("edge", link.endpoint)
    for name in ("early", "ticker"):
        site.wait_active(name)
    link.cut()
    wait_state(system, "edge", HostState.LOST)
    wait_until(lambda: site.host_of("early") == "local", "the first of them to start elsewhere")
    link.heal()
    wait_until(lambda: state_of(system, "edge") is HostState.JOINED, "edge to be back")
    wait_until(lambda: {site.host_of(name) for name in ("early", "ticker")} == {"local"}, "both to be elsewhere")
    wait_until(lambda: site.journal()[0].outcome is Outcome.APPLIED_STATE_LOST, "the end of the adaptation")
    wait_until(lambda: not any(process.pid for process in system.client.hosts()["edge"].processes), "none to be left")
    assert guest.process.poll() is None


@pytest.mark.evidence
@pytest.mark.parametrize(
    "changes",
    [
        (Move("ticker", "local"),),
        (Move("ticker", "local"), SetParameters("ticker", {"step": 4})),
        (Move("ticker", "local"), Swap("ticker", "tests.host.parts:Leaper", {"step": 4})),
    ],
)
def test_a_component_on_a_lost_host_can_be_moved_by_hand(site: Site, changes: tuple[Change, ...]) -> None:
    site.up()
    guest = site.join()
    first = site.wait_active("ticker")
    guest.process.kill()
    wait_state(site.system, "edge", HostState.LOST)
    report = site.adapt(*changes)
    assert report.outcome is Outcome.APPLIED_STATE_LOST, report
    assert site.wait_active("ticker", first) > first
    assert site.host_of("ticker") == "local"
    assert site.system.client.view("ticker").parameters["step"] == (1 if len(changes) == 1 else 4)


@pytest.mark.evidence
def test_a_host_that_is_lost_again_loses_its_components_again(site: Site) -> None:
    system = site.up(TICKER + "  moody: {class: 'tests.host.parts:Moody'}\n", MOVE)
    for loss in (1, 2):
        guest = site.join()
        if loss == 2:
            second = ComponentSpec(cls="tests.host.parts:Ticker", host="edge", connections={"ticks": "more"})
            assert site.adapt(Add("second", second, (TopicSpec("more", "host_tests/Tick"),))).outcome is Outcome.APPLIED
        name = "ticker" if loss == 1 else "second"
        first = site.wait_active(name)
        guest.process.kill()
        site.wait_active(name, first)
        assert site.host_of(name) == "local"
    assert len(system.said("host.lost", "edge")) == 2


# --- partitions ---


def _joined_over_a_link(site: Site, hosts: str) -> tuple[JoinedHost, Link]:
    site.up(hosts=hosts)
    link = site.link()
    guest = site.join("edge", link.endpoint)
    site.wait_active("ticker")
    return guest, link


def test_a_partition_ends_what_may_start_elsewhere_before_it_does(site: Site) -> None:
    guest, link = _joined_over_a_link(site, MOVE)
    first, pid = site.wait_active("ticker"), site.pid("ticker")
    link.cut()
    wait_until(lambda: not exists(pid) or site.host_of("ticker") == "local", "the cut to be noticed")
    assert not exists(pid), "the old run has ended before there is a new one"
    second = site.wait_active("ticker", first)
    assert site.host_of("ticker") == "local"
    assert exists(guest.process.pid)
    link.heal()
    wait_state(site.system, "edge", HostState.JOINED)
    wait_until(lambda: not children_without_zygote(guest), "nothing to run on edge")
    assert site.wait_active("ticker") == second, "whoever acts goes on acting"
    wait_until(lambda: site.process("ticker", "edge") is None, "edge to have forgotten it")
    assert not site.system.said("component.removed", "ticker")


def children_without_zygote(guest: JoinedHost) -> list[int]:
    """Return the component processes of a host."""
    zygote = next(iter(children_of(guest.process.pid)), 0)
    return [pid for pid in children_of(zygote) if exists(pid)] if zygote else []


def test_a_partition_leaves_components_alone_that_wait_for_their_host(site: Site) -> None:
    _, link = _joined_over_a_link(site, WAIT)
    first, pid = site.wait_active("ticker"), site.pid("ticker")
    link.cut()
    wait_state(site.system, "edge", HostState.LOST)
    assert exists(pid)
    link.heal()
    wait_state(site.system, "edge", HostState.JOINED)
    assert site.wait_active("ticker") == first
    assert site.pid("ticker") == pid, "the same run goes on"
    assert site.system.said("host.returned", "edge")


def _hold(site: Site, change: Change, confirm: float = 60.0) -> str:
    """Have a change made and watched over; returns the adaptation's id once all of it is done."""
    request = AdaptationRequest((change,), confirm=confirm, wait=False)
    report = site.system.client.call("adaptation_manager/adapt", request, AdaptationReport, PATIENCE)
    wait_until(lambda: site.journal()[0].outcome is Outcome.CONFIRMING, "the change to be watched over")
    return report.id


def _hold_a_change(site: Site) -> None:
    """Have a step of 4 set and watched over."""
    _hold(site, SetParameters("ticker", {"step": 4}), confirm=20.0)
    assert site.system.client.view("ticker").parameters["step"] == 4


def _cancel(site: Site, held: str) -> None:
    """Cancel an adaptation that is watched over."""
    cancel = CancelAdaptation(held)
    report = site.system.client.call("adaptation_manager/cancel", cancel, AdaptationReport, PATIENCE)
    assert report.outcome is Outcome.CANCELLED, report.error


def test_a_host_that_is_silent_while_a_change_is_undone_is_told_as_it_answers_again(site: Site) -> None:
    _, link = _joined_over_a_link(site, "{edge: {lost_after: 60}, arm: {}}")
    first = site.wait_active("ticker")
    _hold_a_change(site)
    link.cut()
    wait_state(site.system, "edge", HostState.SILENT)
    wait_until(lambda: site.journal()[0].outcome is Outcome.ROLLED_BACK, "the change to be undone")
    report = site.journal()[0]
    assert [(each.component, each.code) for each in report.unreached] == [("ticker", UnreachedCode.HOST_SILENT)]
    link.heal()
    wait_state(site.system, "edge", HostState.JOINED)
    assert site.wait_active("ticker", first) > first, "it begins again"
    assert site.system.client.view("ticker").parameters["step"] == 1
    assert not site.system.said("host.lost", "edge")


def test_a_component_that_is_removed_while_its_host_is_silent_ends_as_that_answers_again(site: Site) -> None:
    guest, link = _joined_over_a_link(site, "{edge: {lost_after: 60}, arm: {}}")
    link.cut()
    wait_state(site.system, "edge", HostState.SILENT)
    assert site.adapt(Remove("ticker")).outcome is Outcome.APPLIED
    link.heal()
    wait_until(lambda: not children_without_zygote(guest), "the component to end")
    assert not site.system.said("host.lost", "edge")


def test_a_component_whose_change_was_undone_while_its_host_was_lost_begins_again(site: Site) -> None:
    _, link = _joined_over_a_link(site, WAIT)
    first, pid = site.wait_active("ticker"), site.pid("ticker")
    _hold_a_change(site)
    link.cut()
    wait_state(site.system, "edge", HostState.LOST)
    wait_until(lambda: site.journal()[0].outcome is Outcome.ROLLED_BACK, "the change to be undone")
    assert exists(pid)
    link.heal()
    assert site.wait_active("ticker", first) > first
    assert site.system.client.view("ticker").parameters["step"] == 1


def test_a_component_whose_host_returns_before_a_change_is_cancelled_begins_again_as_before(site: Site) -> None:
    system = site.up(TICKER.replace("host: edge", "host: edge, state: inactive"))
    link = site.link()
    site.join("edge", link.endpoint)

    def step() -> object:
        seen = system.client.components().get("ticker")
        at_rest = seen is not None and seen.alive and seen.status is not None and seen.status.state is State.INACTIVE
        with contextlib.suppress(NoAnswer):  # it ends, to begin again
            return system.client.view("ticker").parameters["step"] if at_rest else None
        return None

    wait_until(lambda: step() == 1, "the ticker to be inactive")
    link.cut()
    wait_state(system, "edge", HostState.LOST)
    held = _hold(site, SetParameters("ticker", {"step": 4}))
    link.heal()
    wait_until(lambda: step() == 4, "the ticker to have begun again")
    _cancel(site, held)
    wait_until(lambda: step() == 1, "the ticker to be as before")


def test_a_component_whose_host_returns_before_its_removal_is_cancelled_begins_again(site: Site) -> None:
    _, link = _joined_over_a_link(site, WAIT)
    first = site.wait_active("ticker")
    link.cut()
    wait_state(site.system, "edge", HostState.LOST)
    held = _hold(site, Remove("ticker"))
    link.heal()
    wait_state(site.system, "edge", HostState.JOINED)
    _cancel(site, held)
    assert site.wait_active("ticker", first) > first


def test_a_component_whose_removal_is_undone_while_its_host_is_silent_again_begins_again(site: Site) -> None:
    guest, link = _joined_over_a_link(site, "{edge: {lost_after: 60}, arm: {}}")
    first = site.wait_active("ticker")
    link.cut()
    wait_state(site.system, "edge", HostState.SILENT)
    held = _hold(site, Remove("ticker"))
    link.heal()
    wait_state(site.system, "edge", HostState.JOINED)
    wait_until(lambda: not children_without_zygote(guest), "the component to end")
    link.cut()
    wait_state(site.system, "edge", HostState.SILENT)
    _cancel(site, held)
    link.heal()
    assert site.wait_active("ticker", first) > first


@pytest.mark.evidence
def test_who_was_moved_by_hand_during_a_partition_is_ended_at_once_when_it_heals(site: Site) -> None:
    guest, link = _joined_over_a_link(site, WAIT)
    first, pid = site.wait_active("ticker"), site.pid("ticker")
    link.cut()
    wait_state(site.system, "edge", HostState.LOST)
    assert site.adapt(Move("ticker", "local")).outcome is Outcome.APPLIED_STATE_LOST
    second = site.wait_active("ticker", first)
    assert exists(pid), "nobody can tell it yet"
    link.heal()
    wait_gone([pid])
    wait_state(site.system, "edge", HostState.JOINED)
    assert not children_without_zygote(guest)
    assert site.wait_active("ticker") == second


@pytest.mark.evidence
def test_a_host_that_was_frozen_ends_what_has_started_elsewhere(site: Site) -> None:
    system = site.up(hosts=MOVE)
    guest = site.join()
    first, pid = site.wait_active("ticker"), site.pid("ticker")
    stop(guest.process.pid)
    second = site.wait_active("ticker", first)
    go_on(guest.process.pid)
    wait_gone([pid])
    wait_state(system, "edge", HostState.JOINED)
    assert site.wait_active("ticker") == second


def test_a_component_whose_host_is_frozen_ends_before_it_starts_elsewhere(site: Site) -> None:
    site.up(hosts=MOVE)
    guest = site.join()
    first, pid = site.wait_active("ticker"), site.pid("ticker")
    stop(guest.process.pid)
    wait_until(lambda: _has_ended(pid) or site.host_of("ticker") == "local", "something to happen")
    assert _has_ended(pid), "the old run has ended before there is a new one"
    second = site.wait_active("ticker", first)
    go_on(guest.process.pid)
    wait_state(site.system, "edge", HostState.JOINED)
    assert site.wait_active("ticker") == second


def test_a_component_that_thaws_after_its_lease_does_nothing_more(site: Site, tmp_path: Path) -> None:
    site.up(hosts=MOVE)
    guest = site.join()
    first, pid = site.wait_active("ticker"), site.pid("ticker")
    for frozen in (pid, guest.process.pid):
        stop(frozen)
    second = site.wait_active("ticker", first)
    go_on(pid)  # its host is frozen still
    wait_until(lambda: _has_ended(pid), "it to end itself")
    assert "ends itself" in next(guest_logs(site, "ticker"))
    go_on(guest.process.pid)
    assert site.wait_active("ticker") == second


def _has_ended(pid: int) -> bool:
    """Tell whether a process acts no more; whoever started it may be frozen, and not have taken note."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2][:1] in "ZX"
    except OSError:
        return True


def guest_logs(site: Site, name: str) -> Iterator[str]:
    """Return what a component has written on any host."""
    return (path.read_text() for path in site.folder.rglob(f"{name}.log") if "ends itself" in path.read_text())


@pytest.mark.evidence
def test_a_host_whose_place_was_taken_ends(site: Site) -> None:
    guest, link = _joined_over_a_link(site, WAIT)
    first, pid = site.wait_active("ticker"), site.pid("ticker")
    link.cut()
    wait_state(site.system, "edge", HostState.LOST)
    secret = site.folder / "bus.secret"
    secret.touch(0o600)
    secret.write_text(site.system.info.secret)
    os.environ["REGRAFT_HOME"] += "-2"
    site.join("edge", "", "--secret", str(secret))
    assert site.wait_active("ticker", first) > first
    link.heal()
    assert guest.process.wait(PATIENCE) == 3
    wait_gone([pid])
    assert "has joined already" in guest.log.read_text()
