"""No source of adaptations takes the manager away from the others, and every request is answered."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest

from regraft import CallFailed
from regraft.bus.memory_bus import MemoryBus
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    Change,
    Connect,
    Outcome,
    SetParameters,
)
from regraft.client import Client
from tests.adaptation.parts import Fragile
from tests.adaptation.system import SYSTEM, System
from tests.support.waiting import PATIENCE, wait_until

AT_ONCE = 40


@contextmanager
def source(system: System, name: str) -> Iterator[Client]:
    """Join as somebody else."""
    with Client(MemoryBus(system.hub), SYSTEM, name, owns_bus=True) as client:
        yield client


def _ask(
    client: Client, change: Change, *, who: str = "", wait: bool = True, patient: bool = False
) -> AdaptationReport:
    request = AdaptationRequest((change,), actor=who, wait=wait)
    return client.call("adaptation_manager/adapt", request, AdaptationReport, 12 * PATIENCE, patient=patient)


def test_who_asks_too_often_is_told_the_limit_and_when_to_come_again(bare_system: System) -> None:
    system = bare_system
    system.start_manager(rate_limit=0.5, burst=3)
    with source(system, "wild") as wild, source(system, "calm") as calm:
        for gain in (0.1, 0.2, 0.3):
            assert _ask(wild, SetParameters("listener", {"gain": gain})).outcome is Outcome.APPLIED
        with pytest.raises(CallFailed, match=r"wild asks for too many.* 0\.5 a second, and 3 at once") as refused:
            _ask(wild, SetParameters("listener", {"gain": 0.4}), who="somebody else")
        assert refused.value.answer is Answer.REFUSED
        assert refused.value.retry_after is not None
        assert 0.0 < refused.value.retry_after <= 2.0
        assert _ask(calm, SetParameters("listener", {"gain": 0.5})).outcome is Outcome.APPLIED
        assert _ask(wild, SetParameters("listener", {"gain": 0.6}), patient=True).outcome is Outcome.APPLIED
    assert system.view("listener").parameters["gain"] == 0.6


def test_one_source_cannot_fill_the_queue_for_the_others(bare_system: System) -> None:
    system = bare_system
    system.start_manager(answer_within=10.0, source_limit=2, queue_limit=4)
    assert system.adapt(SetParameters("fragile", {"mood": "hangs"})).outcome is Outcome.APPLIED
    system.adapt(SetParameters("fragile", {"level": 1}), wait=False)
    with source(system, "wild") as wild, source(system, "calm") as calm:
        for gain in (0.1, 0.2):
            _ask(wild, SetParameters("listener", {"gain": gain}), wait=False)
        with pytest.raises(CallFailed, match="wild has 2 adaptations waiting, and 2 is the limit for one source"):
            _ask(wild, SetParameters("listener", {"gain": 0.3}), wait=False)
        last = _ask(calm, SetParameters("listener", {"gain": 0.4}), wait=False)
        Fragile.release.set()
        wait_until(lambda: system.lines(id=last.id).entries[0].outcome is Outcome.APPLIED)


def test_a_component_is_one_source_in_all_its_requests(system: System) -> None:
    seen: list[str] = []
    manager = system.running["manager"].component
    real = manager._throttle.admit

    def admit(asking: str, *rest: object, **more: object) -> None:
        seen.append(asking)
        real(asking, *rest, **more)

    manager._throttle.admit = admit
    scanner = system.running["scanner"].component
    done = threading.Event()

    async def ask() -> None:
        request = AdaptationRequest((SetParameters("listener", {"gain": 0.7}),), actor="nobody")
        await scanner.kit.call("adaptation_manager/adapt", request, AdaptationReport)
        done.set()

    system.running["scanner"].runtime.post(lambda: scanner.kit.spawn(ask()))
    assert done.wait(PATIENCE)
    system.adapt(SetParameters("listener", {"gain": 0.8}))
    assert seen == ["scanner", "tester"]


@pytest.mark.parametrize("each", [40, pytest.param(200, marks=pytest.mark.evidence)])
def test_what_five_ask_at_once_is_applied_one_after_the_other_without_a_gap(system: System, each: int) -> None:
    def change(number: int) -> Change:
        if number % 10 == 0:
            return Connect("listener", "hint", ("hints", "spare")[number // 10 % 2])
        return SetParameters(("listener", "second")[number % 2], {"gain": number % 100 / 100})

    names = ["operator-one", "operator-two", "planner-one", "planner-two", "planner-three"]
    reports: list[AdaptationReport] = []

    def press(name: str) -> None:
        with source(system, name) as client, ThreadPoolExecutor(AT_ONCE) as at_once:
            reports.extend(at_once.map(lambda n: _ask(client, change(n), who=name, patient=True), range(each)))

    pressing = [threading.Thread(target=press, args=(name,)) for name in names]
    for thread in pressing:
        thread.start()
    for thread in pressing:
        thread.join(12 * PATIENCE)
    assert len(reports) == len(names) * each
    assert {report.outcome for report in reports} == {Outcome.APPLIED}
    assert sorted(report.revision_after for report in reports) == list(range(2, 2 + len(reports)))
    assert all(report.revision_after == report.revision_before + 1 for report in reports)
    assert {name: sum(report.request.actor == name for report in reports) for name in names} == dict.fromkeys(
        names, each
    )
    assert len({report.id for report in reports}) == len(reports)
