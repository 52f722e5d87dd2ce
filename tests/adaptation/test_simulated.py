"""Adaptations under simulated time: in slots, in which no time passes, and the same in every run."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from regraft.adaptation_manager.journal.journal import Journal, JournalError
from regraft.bus.memory_bus import MemoryHub
from regraft.bus_schema.model.adaptation import AdaptationReport, ChangeState, Outcome, Remove, SetParameters
from regraft.bus_schema.model.architecture import Architecture, TopicSpec
from regraft.bus_schema.model.lifecycle import Transition
from tests.adaptation.host_stub import HostStub
from tests.adaptation.parts import Changer, Collector, Confirmer, Judge, Keeper, Planner, Ticker
from tests.adaptation.system import SYSTEM, System, spec_of
from tests.support.waiting import wait_until


def _system(folder: Path) -> System:
    specs = [
        spec_of("ticker", Ticker, parameters={"speed": "max"}),
        spec_of("collector", Collector),
        spec_of("keeper", Keeper),
        spec_of("planner", Planner),
    ]
    topics = {name: TopicSpec(name, "regraft/Twist") for name in ("count", "echo")}
    architecture = Architecture(SYSTEM, 1, True, {spec.name: spec for spec in specs}, topics)
    hub = MemoryHub()
    system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    system.start_manager()
    for name in ("collector", "keeper", "planner", "ticker"):
        system.start(name)
    return system


def _run(folder: Path) -> tuple[list[Any], int, int]:
    """Run until the planner is done; returns what became of its adaptations, and the first numbers heard."""
    folder.mkdir()
    system = _system(folder)
    try:
        planner = system.running["planner"].component
        counters = [system.running[name].component for name in ("collector", "keeper")]
        wait_until(lambda: len(getattr(planner, "reports", ())) == 6)
        last = planner.reports[-1].tick
        wait_until(lambda: all(len(counter.collected) > last + 10 for counter in counters))
        heard = [list(counter.collected) for counter in counters]
        for numbers in heard:
            assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        ends = [(r.id, r.outcome, r.tick, r.started, [s.state for s in r.steps]) for r in planner.reports]
        return ends, heard[0][0], heard[1][0]
    finally:
        system.end()


def test_rewiring_in_step_loses_and_doubles_nothing_and_is_the_same_in_every_run(tmp_path: Path) -> None:
    first = _run(tmp_path / "one")
    assert [outcome for _, outcome, *_ in first[0]] == [Outcome.APPLIED] * 6
    assert all(tick is not None for _, _, tick, *_ in first[0])
    assert _run(tmp_path / "two") == first


def _coming_and_going(folder: Path, delay: float) -> tuple[list[Any], list[list[int]]]:
    """Run until the changer is done; returns what became of its adaptations, and what each extra one heard."""
    folder.mkdir()
    specs = [
        spec_of("ticker", Ticker, parameters={"speed": "max"}),
        spec_of("collector", Collector),
        spec_of("changer", Changer),
    ]
    topics = {name: TopicSpec(name, "regraft/Twist") for name in ("count", "echo")}
    architecture = Architecture(SYSTEM, 1, True, {spec.name: spec for spec in specs}, topics)
    hub = MemoryHub()
    system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    extras: list[Any] = []

    def launch(name: str, incarnation: int) -> None:
        threading.Event().wait(delay * incarnation)
        extras.append(system.start(name, incarnation).component)

    system.host.launch = launch
    try:
        system.start_manager()
        for name in ("collector", "changer", "ticker"):
            system.start(name)
        changer = system.running["changer"].component
        wait_until(lambda: len(getattr(changer, "reports", ())) == 6)
        clock = system.client.clock()
        assert clock is not None
        assert clock.reproducible
        assert clock.dropped == ()
        assert "extra" not in system.running
        ends = [(r.outcome, r.tick, r.started, [s.state for s in r.steps]) for r in changer.reports]
        return ends, [extra.collected for extra in extras]
    finally:
        system.end()


def test_coming_and_going_is_the_same_in_every_run_however_long_a_process_takes_to_start(tmp_path: Path) -> None:
    first = _coming_and_going(tmp_path / "one", 0.0)
    assert [outcome for outcome, *_ in first[0]] == [Outcome.APPLIED] * 6
    assert [len(heard) > 5 for heard in first[1]] == [True] * 3
    assert _coming_and_going(tmp_path / "two", 0.05) == first


@pytest.mark.parametrize("transitions", [("deactivate",), ("deactivate", "cleanup")])
def test_a_change_of_state_that_is_undone_leaves_no_trace_in_what_is_heard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, transitions: tuple[str, ...]
) -> None:
    system = _system(tmp_path)
    try:
        keeper = system.running["keeper"].component
        wait_until(lambda: len(getattr(keeper, "collected", ())) > 10)
        monkeypatch.setattr(Journal, "end", _undoes_what_was_applied(Journal.end))
        for _ in range(5):
            report = system.adapt(*(ChangeState("keeper", Transition(name)) for name in transitions))
            assert report.outcome is Outcome.ROLLED_BACK, report
            assert report.tick is not None
            _wait_for_tick(system, report.tick + 20)
        if "cleanup" not in transitions:
            assert keeper.collected == list(range(1, len(keeper.collected) + 1))
        assert not [event for event in system.events if event.kind in ("message.lost", "clock.fault")]
        clock = system.client.clock()
        assert clock is not None
        assert clock.reproducible
    finally:
        system.end()


def _wait_for_tick(system: System, tick: int) -> None:
    def reached() -> bool:
        clock = system.client.clock()
        return clock is not None and clock.tick >= tick

    wait_until(reached)


def _undoes_what_was_applied(end: Callable[[Journal, AdaptationReport], None]) -> Callable[..., None]:
    def full(self: Journal, report: AdaptationReport) -> None:
        if report.outcome is Outcome.APPLIED:
            raise JournalError("database or disk is full")
        end(self, report)

    return full


def test_an_adaptation_from_outside_gets_a_slot(tmp_path: Path) -> None:
    system = _system(tmp_path)
    try:
        report = system.adapt(SetParameters("ticker", {"speed": "real"}))
        assert report.outcome is Outcome.APPLIED, report
        assert report.tick is not None
    finally:
        system.end()


def _time(system: System) -> float:
    clock = system.client.clock()
    assert clock is not None
    return clock.time / 1e9


def test_what_was_to_be_removed_handles_all_that_came_in_the_time_that_passed(tmp_path: Path) -> None:
    system = _system(tmp_path)
    try:
        counters: list[Any] = [system.running[name].component for name in ("collector", "keeper")]
        wait_until(lambda: all(counter.collected for counter in counters))
        held = system.adapt(Remove("collector"), Remove("keeper"), confirm=3600.0, wait=False)
        wait_until(lambda: system.lines(id=held.id).entries[0].outcome is Outcome.CONFIRMING)
        begun, heard = _time(system), [len(counter.collected) for counter in counters]
        wait_until(lambda: _time(system) > begun + 1.0)
        assert [len(counter.collected) for counter in counters] == heard
        assert system.cancel(held.id).outcome is Outcome.CANCELLED
        wait_until(lambda: all(len(c.collected) > n + 30 for c, n in zip(counters, heard, strict=True)))
        for numbers in (list(counter.collected) for counter in counters):
            assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    finally:
        system.end()


def _confirmed(folder: Path) -> tuple[list[Any], list[int]]:
    """Run until the confirmer is done; returns what became of its adaptations, and all that was heard meanwhile."""
    folder.mkdir()
    specs = [
        spec_of("ticker", Ticker, parameters={"speed": "max"}),
        spec_of("collector", Collector),
        spec_of("keeper", Keeper),
        spec_of("judge", Judge, parameters={"broken_from": 25, "broken_until": 40}),
        spec_of("confirmer", Confirmer),
    ]
    topics = {name: TopicSpec(name, "regraft/Twist") for name in ("count", "echo")}
    architecture = Architecture(SYSTEM, 1, True, {spec.name: spec for spec in specs}, topics)
    hub = MemoryHub()
    system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    try:
        system.start_manager()
        for name in ("collector", "keeper", "judge", "confirmer", "ticker"):
            system.start(name)
        confirmer, collector = (system.running[name].component for name in ("confirmer", "collector"))
        wait_until(lambda: len(getattr(confirmer, "reports", ())) == 4)
        last = confirmer.reports[-1].tick
        wait_until(lambda: len(collector.collected) > last)
        clock = system.client.clock()
        assert clock is not None
        assert clock.reproducible
        ends = [
            (r.outcome, r.tick, r.started, r.revision_after, r.error, r.phases[-1].duration) for r in confirmer.reports
        ]
        return ends, list(collector.collected)[:last]
    finally:
        system.end()


def test_confirmation_runs_across_ticks_and_is_the_same_in_every_run(tmp_path: Path) -> None:
    ends, heard = _confirmed(tmp_path / "one")
    assert heard == list(range(heard[0], heard[0] + len(heard)))
    assert {Outcome.APPLIED, Outcome.ROLLED_BACK} == {end[0] for end in ends}
    assert _confirmed(tmp_path / "two") == (ends, heard)
