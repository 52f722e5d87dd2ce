"""Who holds what only one process can hold lets go of it before its successor takes hold; nothing else is lost."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft.bus.memory_bus import MemoryHub
from regraft.bus_schema.model.adaptation import Outcome, SetParameters, Swap
from regraft.bus_schema.model.architecture import Architecture, HostRules, TopicSpec
from regraft.bus_schema.model.lifecycle import State
from tests.adaptation.host_stub import HostStub
from tests.adaptation.parts import Fragile, Ticker
from tests.adaptation.swaps.holding import Clumsy, Holder
from tests.adaptation.system import SYSTEM, System, spec_of
from tests.handover.parts import Ask, Item, Report, Sink, Source
from tests.support.machine.ports import free_port
from tests.support.waiting import PATIENCE, wait_until

HERE = "tests.adaptation.swaps.holding"
ARM = Swap("holder", f"{HERE}:Arm")


def _site(folder: Path, simulated: bool, cls: type[Holder] = Holder) -> System:
    values = {"port": free_port(), "lock": str(folder / "lock"), "offset": 3}
    specs = [
        spec_of("source", Source, parameters={"rate": 20.0 if simulated else 500.0}),
        spec_of("holder", cls, parameters=values),
        spec_of("sink", Sink),
        spec_of("fragile", Fragile, connections={"heard": "numbers"}, parameters={"mood": "refuses"}),
    ]
    if simulated:
        specs.append(spec_of("ticker", Ticker, parameters={"speed": "max"}))
    topics = {name: TopicSpec(name, "handover_tests/Item") for name in ("items", "totals", "config")}
    topics |= {name: TopicSpec(name, "regraft/Twist") for name in ("numbers", "count", "echo")}
    rules = {"local": HostRules(devices=("arm",))}
    architecture = Architecture(SYSTEM, 1, simulated, {spec.name: spec for spec in specs}, topics, host_rules=rules)
    hub = MemoryHub()
    system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    system.start_manager()
    for spec in specs:
        system.start(spec.name)
    _hears_on(system)
    return system


@pytest.fixture(params=[False, True], ids=["real clock", "in step"])
def site(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[System]:
    """Start it under either clock."""
    system = _site(tmp_path, request.param)
    yield system
    system.end()


def _report(system: System) -> Report:
    return system.client.call("report", Ask(), Report, PATIENCE)


def _hears_on(system: System, count: int = 20) -> None:
    goal = _report(system).heard + count
    wait_until(lambda: _report(system).heard >= goal)


def _all_is_well(system: System) -> None:
    """Check that nothing was missed, that the port is held, and that the clock has not lost anybody."""
    _hears_on(system)
    last = system.client.call("say", Ask(), Item, PATIENCE).number
    wait_until(lambda: _report(system).last >= last)
    report = _report(system)
    assert (report.lost, report.doubled, report.disordered, report.wrong) == (0, 0, 0, 0)
    port = system.architecture.components["holder"].parameters["port"]
    assert system.client.call("held", Ask(), Item, PATIENCE).number == port
    with socket.create_connection(("127.0.0.1", int(str(port))), 1.0):
        pass
    clock = system.client.clock()
    assert clock is None or (clock.reproducible, clock.dropped) == (True, ())


def _runs(system: System) -> list[int]:
    return [started_as for (name, started_as), run in system.runs.items() if name == "holder" and run.thread.is_alive()]


def test_it_is_let_go_of_and_taken_and_the_gap_is_told(site: System) -> None:
    report = site.adapt(ARM)
    assert report.outcome is Outcome.APPLIED, report
    assert report.steps[1].action.endswith("with a gap: it lets go first")
    assert _runs(site) == [2]
    assert site.view("holder").state is State.ACTIVE
    (gap,) = [event for event in site.events if event.kind == "adaptation.gap"]
    assert 0.0 <= gap.details["seconds"] < PATIENCE
    _all_is_well(site)
    undone = site.undo(report.id)
    assert undone.outcome is Outcome.APPLIED, undone
    _all_is_well(site)


def test_a_successor_that_cannot_go_on_gives_back_what_it_held(site: System) -> None:
    run = site.running["holder"]
    for _ in range(2):
        report = site.adapt(Swap("holder", f"{HERE}:Lame"))
        assert report.outcome is Outcome.ROLLED_BACK, report
        assert "cannot get up" in report.error
        assert site.running["holder"] is run
        _all_is_well(site)
    assert site.adapt(ARM).outcome is Outcome.APPLIED
    _all_is_well(site)


def test_whoever_cannot_say_its_state_takes_hold_again_and_lets_go_without_it(site: System) -> None:
    assert site.adapt(Swap("holder", f"{HERE}:Mute")).outcome is Outcome.APPLIED
    report = site.adapt(Swap("holder", f"{HERE}:Lame", with_state=False))
    assert (report.outcome, "cannot get up" in report.error) == (Outcome.ROLLED_BACK, True), report
    port = site.architecture.components["holder"].parameters["port"]
    assert site.client.call("held", Ask(), Item, PATIENCE).number == port
    assert site.adapt(Swap("holder", ARM.cls, with_state=False)).outcome is Outcome.APPLIED
    assert site.client.call("held", Ask(), Item, PATIENCE).number == port


def test_a_successor_that_cannot_take_hold_leaves_it_to_the_run_of_before(site: System) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        report = site.adapt(Swap("holder", parameters={"port": other.getsockname()[1]}))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert "in use" in report.error
    _all_is_well(site)


def test_a_later_failure_gives_it_back_with_the_living_state(site: System) -> None:
    run = site.running["holder"]
    report = site.adapt(ARM, SetParameters("fragile", {"level": 3}))
    assert report.outcome is Outcome.ROLLED_BACK, report
    assert site.running["holder"] is run
    _all_is_well(site)
    assert site.adapt(ARM).outcome is Outcome.APPLIED
    _all_is_well(site)


def test_what_is_raised_on_letting_go_is_reported_and_the_swap_goes_on(tmp_path: Path) -> None:
    system = _site(tmp_path, simulated=False, cls=Clumsy)
    try:
        assert system.adapt(ARM).outcome is Outcome.APPLIED
        assert any("dropped it" in event.text for event in system.events)
        _all_is_well(system)
    finally:
        system.end()
