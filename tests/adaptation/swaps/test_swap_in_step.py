"""Swaps under simulated time: in a slot, in which no time passes, and the same in every run."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from regraft.adaptation_manager.execution import transaction
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.messages.protocol.host import StartSuccessor
from regraft.bus_schema.model.adaptation import Outcome, Swap
from regraft.bus_schema.model.architecture import Architecture, TopicSpec
from regraft.client import Client
from regraft.lockstep import step_dispatch
from tests.adaptation.failures.test_recovery import dying
from tests.adaptation.host_stub import HostStub
from tests.adaptation.parts import Fragile, Ticker
from tests.adaptation.swaps.gathering import HERE, Gatherer, Swapper, Witness
from tests.adaptation.system import SYSTEM, System, spec_of
from tests.handover.parts import Ask, Item, Source
from tests.support.waiting import wait_until

OUTCOMES = [Outcome.APPLIED] * 2 + [Outcome.ROLLED_BACK] * 4 + [Outcome.APPLIED] * 2


def _system(folder: Path, delay: float) -> System:
    folder.mkdir(exist_ok=True)
    gatherer = spec_of("gatherer", Gatherer, services={name: name for name in ("count", "ponder", "walk")})
    specs = [
        spec_of("ticker", Ticker, parameters={"speed": "max"}),
        spec_of("source", Source, parameters={"rate": 20.0}),
        gatherer,
        spec_of("witness", Witness),
        spec_of("fragile", Fragile, connections={"heard": "echo"}, parameters={"mood": "refuses"}),
        spec_of("swapper", Swapper),
    ]
    topics = {
        name: TopicSpec(name, "handover_tests/Item") for name in ("items", "config", "totals", "sums", "greetings")
    }
    topics |= {name: TopicSpec(name, "regraft/Twist") for name in ("count", "echo")}
    architecture = Architecture(SYSTEM, 1, True, {spec.name: spec for spec in specs}, topics)
    hub = MemoryHub()
    system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    succeed = system.host.succeed

    def late(asked: StartSuccessor, incarnation: int) -> None:
        threading.Event().wait(delay * (incarnation % 3))
        succeed(asked, incarnation)

    system.host.succeed = late
    system.start_manager()
    for name in ("source", "gatherer", "witness", "fragile", "swapper", "ticker"):
        system.start(name)
    return system


def _run(folder: Path, delay: float, check: Callable[[System], object] = lambda _: None) -> tuple[list[Any], list[Any]]:
    """Run until the swapper is done and a while longer; returns what became of its adaptations, and what was seen."""
    system = _system(folder, delay)
    try:
        witness, swapper = (system.running[name].component for name in ("witness", "swapper"))
        wait_until(lambda: len(getattr(swapper, "reports", ())) == len(Swapper.script))
        last = swapper.reports[-1].started + 2.0
        wait_until(lambda: witness.seen[-1][1] > last)
        told = system.client.clock()
        assert told is not None
        assert (told.reproducible, told.dropped) == (True, ()), told
        assert "gatherer" in told.members
        check(system)
        return swapper.reports, [one for one in witness.seen if one[1] <= last]
    finally:
        system.end()


def _of(seen: list[Any], what: str) -> list[tuple[int, int]]:
    return [(number, total) for kind, _, number, total in seen if kind == what]


def test_swaps_in_slots_lose_and_double_nothing_and_are_the_same_in_every_run(tmp_path: Path) -> None:
    reports, seen = _run(tmp_path / "one", 0.0)
    assert [report.outcome for report in reports] == OUTCOMES, [(r.outcome, r.error, r.violations) for r in reports]
    totals = _of(seen, "total")
    numbers = [number for number, _ in totals]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    first = totals[0][1] - totals[0][0]
    assert totals == [(n, first + sum(range(numbers[0], n + 1))) for n in numbers]
    sums = [one for one in _of(seen, "sum") if one[0]]
    assert [look for look, _ in sums] == list(range(sums[0][0], sums[0][0] + len(sums)))
    assert all(total == sum(range(total and _last(total) + 1)) for _, total in sums), sums
    assert [total for _, total in _of(seen, "count")] != []
    assert {kind for kind, *_ in seen} == {"total", "sum", "greeting", "count", "ponder", "walk"}
    assert all(number == 30 for number, _ in _of(seen, "walk"))
    assert len(_of(seen, "walk")) >= 2
    assert _run(tmp_path / "two", 0.03) == (reports, seen)


def _last(total: int) -> int:
    """Return the number up to which all are added up to a total."""
    return int(((8 * total + 1) ** 0.5 - 1) / 2 + 0.5)


def test_who_goes_on_sees_the_time_at_which_the_other_stopped(tmp_path: Path) -> None:
    reports, seen = _run(tmp_path, 0.0)
    swapped = [r for r in reports if r.outcome is Outcome.APPLIED and "Thinker" in r.steps[0].action]
    greetings = [(number, tick) for number, tick in _of(seen, "greeting") if tick]
    for report in swapped:
        assert (round(report.started * 1000), report.tick) in greetings


def test_the_source_of_time_and_who_lives_by_another_clock_are_not_swapped_and_why(tmp_path: Path) -> None:
    system = _system(tmp_path, 0.0)
    try:
        report = system.adapt(
            Swap("ticker", "tests.adaptation.parts:Collector"),
            Swap("fragile", "tests.adaptation.swaps.swappable:Onlooker"),
        )
        assert report.outcome is Outcome.REJECTED
        problems = {violation.component: violation.problem for violation in report.violations}
        assert "is the source of simulated time" in problems["ticker"]
        assert "lives by the wall clock, and the component in simulated time" in problems["fragile"]
    finally:
        system.end()


def test_a_goal_of_a_client_outside_of_the_clock_ends_with_it_after_a_swap(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def rest(witness: Witness) -> None:
        await witness.kit.sleep(86_400.0)

    monkeypatch.setattr(Swapper, "script", ())
    monkeypatch.setattr(Witness, "walk", rest)
    system = _system(tmp_path, 0.0)
    try:
        wait_until(lambda: (told := system.client.clock()) is not None and "gatherer" in told.members)
        passer = Client(MemoryBus(system.hub), SYSTEM, "passer")
        passer.goal("walk", Ask(10_000_000), Item, Item)
        assert system.adapt(Swap("gatherer", f"{HERE}:Thinker")).outcome is Outcome.APPLIED
        walking = next(each for each in system.running["gatherer"].runtime.servers if each.name == "walk")
        assert [goal.client for goal in walking.goals.values()] == ["passer"]
        passer.close()
        wait_until(lambda: not walking.goals, "the walk to end")
    finally:
        system.end()


@pytest.mark.parametrize(("name", "when"), [("perform", "before"), ("perform", "after"), ("let_speak", "before")])
def test_a_swap_that_is_interrupted_in_its_slot_is_undone_on_return(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, name: str, when: str
) -> None:
    monkeypatch.setattr(step_dispatch, "STEP_BOUND", 0.5)
    monkeypatch.setattr(Swapper, "script", ())
    system = _system(tmp_path, 0.0)
    try:
        witness, run = system.running["witness"].component, system.running["gatherer"]
        wait_until(lambda: len(_of(getattr(witness, "seen", []), "total")) > 20)
        owner: Any = transaction if name == "perform" else Hosts
        with monkeypatch.context() as patch:
            dying(patch, owner, name, 2 if name == "perform" else 1, when)
            pending = system.adapt(Swap("gatherer", f"{HERE}:Thinker"), wait=False)
            wait_until(lambda: not system.running["manager"].thread.is_alive())
        system.start_manager()
        (line,) = system.lines(id=pending.id).entries
        assert (line.outcome, line.error) == (Outcome.ROLLED_BACK, "interrupted: the manager was restarted")
        assert system.running["gatherer"] is run
        assert "simulated time does not include it" not in caplog.text
        heard = len(_of(witness.seen, "total"))
        wait_until(lambda: len(_of(witness.seen, "total")) > heard + 20)
        wait_until(lambda: (told := system.client.clock()) is not None and "gatherer" in told.members)
        report = system.adapt(Swap("gatherer", f"{HERE}:Thinker"))
        assert report.outcome is Outcome.APPLIED, report
    finally:
        system.end()
