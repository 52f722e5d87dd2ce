"""Components are swapped in a running system of real processes: nothing is lost, and nobody notices."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest, UndoAdaptation
from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Change,
    ChangeState,
    Outcome,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.lifecycle import Transition
from tests.handover.parts import Ask, Item, Report
from tests.host.conftest import Start
from tests.support.machine.processes import children_of, exists, kill
from tests.support.systems import System, all_ended, home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

HEAD = """\
system: tests
clock: real
imports: [tests.handover.parts]
topics:
  items: {type: handover_tests/Item}
  totals: {type: handover_tests/Item}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
"""
STACK = """\
  source: {class: 'tests.handover.parts:Source'}
  totaller: {class: 'tests.handover.parts:Totaller', parameters: {offset: 3}}
  sink: {class: 'tests.handover.parts:Sink'}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite, answer_within: 1.0, undo_within: 3.0, start_within: 10.0}
"""
SLOW = STACK.replace("parts:Source'", "parts:Source', parameters: {rate: 200}")
"""The same with a stream of 200 Hz instead of 1 kHz, which costs a third."""
PARTS = "tests.handover.parts"
DOUBLER = Swap("totaller", f"{PARTS}:Doubler")


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Return a source at 200 Hz, a totaller, a sink that checks what this says, and a manager."""
    folder = tmp_path_factory.mktemp("swapping")
    (folder / "stack.yaml").write_text(HEAD + SLOW)
    with home(folder / "home"), all_ended() as started:
        started.append(System(folder / "stack.yaml"))
        _wait_flowing(started[0])
        yield started[0]


@pytest.fixture
def running(shared: System) -> System:
    """Return the system of the file, with its totaller as it was at first; the test costs no state."""
    adapted = adapt(shared, Swap("totaller", f"{PARTS}:Totaller", {"offset": 3}))
    assert adapted.outcome is Outcome.APPLIED, adapted
    run = shared.client.view("totaller").incarnation
    shared.wait_for("totaller", lambda p: p.incarnation == run, "known to its host")
    hears_on(shared, 20)
    return shared


@pytest.fixture
def own(start: Start, monkeypatch: pytest.MonkeyPatch) -> System:
    """Return such a system for a test that costs state."""
    monkeypatch.setattr("tests.host.conftest.HEAD", HEAD)
    system = start(SLOW)
    _wait_flowing(system)
    return system


def _wait_flowing(system: System) -> None:
    for name in ("source", "totaller", "sink", "adaptation_manager"):
        system.wait_running(name)
    hears_on(system, 20)


def adapt(system: System, *changes: Change, **more: Any) -> AdaptationReport:
    request = AdaptationRequest(changes, **more)
    return system.client.call("adaptation_manager/adapt", request, AdaptationReport, PATIENCE)


def undo(system: System, report: AdaptationReport) -> AdaptationReport:
    return system.client.call("adaptation_manager/undo", UndoAdaptation(report.id), AdaptationReport, PATIENCE)


def report_of(system: System) -> Report:
    return system.client.call("report", Ask(), Report, PATIENCE)


def hears_on(system: System, count: int) -> None:
    goal = report_of(system).heard + count
    wait_until(lambda: report_of(system).heard >= goal)


def faults(system: System) -> tuple[int, int, int, int]:
    """Return how many items were lost, doubled, disordered and wrong until now."""
    last = system.client.call("say", Ask(), Item, PATIENCE).number
    wait_until(lambda: report_of(system).last >= last)
    report = report_of(system)
    return report.lost, report.doubled, report.disordered, report.wrong


NOTHING = (0, 0, 0, 0)


def speaks_again(system: System, before: ProcessStatus) -> ProcessStatus:
    """Wait until the host has told that the process of before speaks for its component; returns its status."""
    return system.wait_for(
        before.component, lambda p: (p.pid, p.started_as) == (before.pid, before.started_as), "as before"
    )


def test_what_is_quarantined_is_replaced_and_goes_on_from_its_checkpoint(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.host.conftest.HEAD", HEAD)
    dying = "{class: 'tests.host.parts:DyingTotaller', restart: {when: always, limit: 1, window: 30.0}}"
    system = start(SLOW.replace("{class: 'tests.handover.parts:Totaller', parameters: {offset: 3}}", dying))
    system.wait_running("totaller")
    calls = [system.client.call("count", Ask(), Item, PATIENCE).total for _ in range(3)]
    system.wait_for("totaller", lambda p: p.state is ProcessState.QUARANTINED, "quarantined")
    system.wait_running("adaptation_manager")
    refused = adapt(system, SetParameters("totaller", {"offset": 1}))
    assert "start or swap it first" in refused.violations[0].problem
    report = adapt(system, DOUBLER)
    assert report.outcome is Outcome.APPLIED, report
    assert system.wait_running("totaller", 3).restarts == 1
    hears_on(system, 20)
    assert system.client.call("double", Ask(21), Item, PATIENCE) == Item(42)
    assert system.client.call("count", Ask(), Item, PATIENCE).total == calls[-1] + 1


LOOPING = (
    "{class: 'tests.host.parts:LoopingTotaller', parameters: {offset: 3}, "
    "restart: {when: always, limit: 1000, window: 30.0, backoff: 0.5}}"
)


def test_what_keeps_ending_is_replaced(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.host.conftest.HEAD", HEAD)
    system = start(SLOW.replace("{class: 'tests.handover.parts:Totaller', parameters: {offset: 3}}", LOOPING))
    system.wait_running("adaptation_manager")
    system.wait_for("totaller", lambda p: p.restarts > 1 and p.state is ProcessState.WAITING, "restarted")
    report = adapt(system, Swap("totaller", "tests.host.parts:StillbornTotaller"))
    assert report.outcome is Outcome.ROLLED_BACK, report
    looping = system.wait_for("totaller", lambda p: p.state is ProcessState.WAITING, "restarted as before")
    system.wait_for("totaller", lambda p: p.restarts > looping.restarts, "restarted again")
    report = adapt(system, DOUBLER)
    assert report.outcome is Outcome.APPLIED, report
    assert report.steps[0].action == "stop tests.host.parts:LoopingTotaller, which keeps ending"
    hears_on(system, 20)
    assert system.client.call("double", Ask(21), Item, PATIENCE) == Item(42)


def test_a_later_failure_gives_the_living_state_back_to_the_process_of_before(own: System) -> None:
    before = own.processes()["totaller"]
    broken = Swap("sink", "tests.host.parts:StillbornSink", with_state=False)
    report = adapt(own, DOUBLER, ChangeState("source", Transition.DEACTIVATE), Swap("source", f"{PARTS}:Unable"))
    assert report.outcome is Outcome.REJECTED, report
    report = adapt(own, DOUBLER, Swap("sink", "tests.host.parts:LameSink"))
    assert report.outcome is Outcome.ROLLED_BACK, report
    speaks_again(own, before)
    wait_until(lambda: own.client.view("totaller").incarnation == own.processes()["totaller"].incarnation > 2)
    after = own.processes()["totaller"]
    hears_on(own, 20)
    assert faults(own) == NOTHING
    kill(after.pid)
    assert own.wait_running("totaller", after.incarnation + 1).restarts == 1
    assert adapt(own, broken).outcome is Outcome.ROLLED_BACK


@pytest.mark.parametrize("cls", ["DiesHandingOver", "HangsHandingOver"])
def test_an_incumbent_that_is_lost_as_it_hands_over_costs_its_state_and_nothing_else(
    start: Start, monkeypatch: pytest.MonkeyPatch, cls: str
) -> None:
    monkeypatch.setattr("tests.host.conftest.HEAD", HEAD)
    system = start(SLOW.replace("parts:Totaller'", f"parts:{cls}'"))
    for name in ("source", "totaller", "sink", "adaptation_manager"):
        system.wait_running(name)
    hears_on(system, 20)
    report = adapt(system, Swap("totaller", f"{PARTS}:Totaller"))
    assert report.outcome is Outcome.APPLIED_STATE_LOST, report
    assert "totaller" in report.error
    assert system.wait_running("totaller", 2).incarnation == 2
    hears_on(system, 20)
    assert faults(system)[3] == 1  # the total began anew, once
    assert adapt(system, DOUBLER).outcome is Outcome.APPLIED
    hears_on(system, 20)
    assert faults(system)[3] == 1


def test_an_incumbent_killed_while_its_successor_gets_ready_costs_its_state_and_nothing_else(
    own: System, tmp_path: Path
) -> None:
    pending = adapt(own, held("totaller", "HeldTotaller", tmp_path), wait=False)
    wait_until(lambda: "gets ready" in own.client.logs("totaller"))
    before = own.processes()["totaller"]
    kill(before.pid)
    go_on(tmp_path)
    ended = line_of(own, pending)
    assert ended.outcome is Outcome.APPLIED_STATE_LOST, ended
    hears_on(own, 20)
    assert own.processes()["totaller"].incarnation == 2


def test_two_that_feed_each_other_both_go_back_when_the_manager_is_killed_between_them(
    start: Start, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("tests.host.conftest.HEAD", HEAD)
    system = start(SLOW.replace(f"{PARTS}:Sink", "tests.host.parts:KeepingSink"))
    for name in ("source", "totaller", "sink", "adaptation_manager"):
        system.wait_running(name)
    hears_on(system, 20)
    before = system.processes()
    pending = adapt(system, DOUBLER, held("sink", "HeldSink", tmp_path), wait=False)
    wait_until(lambda: any("takes its time" in line for line in system.client.logs("sink")))
    kill(before["adaptation_manager"].pid)
    go_on(tmp_path)
    assert line_of(system, pending).outcome is Outcome.ROLLED_BACK
    speaks_again(system, before["totaller"])
    speaks_again(system, before["sink"])
    hears_on(system, 20)
    assert faults(system) == NOTHING


# --- what costs no state, in one system ---


def test_another_class_goes_on_with_the_state_and_nobody_misses_anything(running: System) -> None:
    before = running.processes()["totaller"]
    swapped = adapt(running, DOUBLER)
    assert swapped.outcome is Outcome.APPLIED, swapped
    after = running.wait_running("totaller", before.incarnation + 1)
    assert after.pid != before.pid
    assert not exists(before.pid)
    assert running.client.call("double", Ask(21), Item, PATIENCE) == Item(42)
    assert running.client.view("totaller").parameters["offset"] == 3
    hears_on(running, 20)
    assert faults(running) == NOTHING

    undone = undo(running, swapped)
    assert undone.outcome is Outcome.APPLIED, undone
    assert running.wait_running("totaller", after.incarnation + 1).incarnation == after.incarnation + 1
    assert running.client.view("totaller").parameters["offset"] == 3
    hears_on(running, 20)
    assert faults(running) == NOTHING


def test_the_same_class_is_configured_otherwise(running: System) -> None:
    for offset in (7, 8, 9):
        report = adapt(running, Swap("totaller", parameters={"offset": offset}))
        assert report.outcome is Outcome.APPLIED, report
        assert running.client.view("totaller").parameters["offset"] == offset
    hears_on(running, 20)
    assert faults(running) == NOTHING
    assert adapt(running, SetParameters("totaller", {"offset": 1})).outcome is Outcome.APPLIED


@pytest.mark.parametrize(
    ("cls", "text"),
    [
        ("tests.host.parts:StillbornTotaller", "its log ends with: no life in me"),
        ("tests.host.parts:SleepyTotaller", "totaller"),
        (f"{PARTS}:DiesRestoring", "totaller"),
        (f"{PARTS}:HangsRestoring", "totaller"),
    ],
)
def test_a_successor_that_is_lost_on_the_way_is_not_missed(running: System, cls: str, text: str) -> None:
    before, processes = running.processes()["totaller"], children_of(running.process.pid)
    report = adapt(running, Swap("totaller", cls))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert text in report.error
    speaks_again(running, before)
    assert children_of(running.process.pid) == processes
    hears_on(running, 20)
    assert faults(running) == NOTHING
    assert adapt(running, DOUBLER).outcome is Outcome.APPLIED
    hears_on(running, 20)
    assert faults(running) == NOTHING


@pytest.mark.parametrize("cls", ["HeldTotaller", "HeldTaking"])
def test_a_manager_killed_in_the_middle_undoes_the_swap_on_its_return(
    running: System, cls: str, tmp_path: Path
) -> None:
    before = running.processes()
    pending = adapt(running, held("totaller", cls, tmp_path), wait=False)
    wait_until(lambda: len(beside(running)) == 1 and beside(running)[0].pid)
    if cls == "HeldTaking":
        wait_until(lambda: any("takes its time" in line for line in running.client.logs("totaller")))
    kill(before["adaptation_manager"].pid)
    go_on(tmp_path)
    running.wait_running("adaptation_manager", before["adaptation_manager"].incarnation + 1)
    assert line_of(running, pending).outcome is Outcome.ROLLED_BACK
    speaks_again(running, before["totaller"])
    wait_until(lambda: beside(running) == ())
    hears_on(running, 20)
    assert faults(running) == NOTHING
    assert adapt(running, DOUBLER).outcome is Outcome.APPLIED


def held(component: str, cls: str, folder: Path) -> Swap:
    """Return a swap whose successor waits in the middle of it until the test lets it go on."""
    return Swap(component, f"tests.host.held:{cls}", {"until": str(folder / "go_on")})


def go_on(folder: Path) -> None:
    """Let the successor go on."""
    (folder / "go_on").touch()


def beside(system: System) -> tuple[ProcessStatus, ...]:
    status = system.client.hosts()["local"].status
    return status.beside if status else ()


def line_of(system: System, report: AdaptationReport) -> AdaptationReport:
    """Return the line of an adaptation once it has ended."""

    def line() -> AdaptationReport:
        request = JournalRequest(report.id)
        return system.client.call("adaptation_manager/journal", request, JournalPage, PATIENCE).entries[0]

    wait_until(lambda: line().outcome is not Outcome.PENDING)
    return line()
