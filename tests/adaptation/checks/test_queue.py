"""One adaptation at a time; the others wait, and can be cancelled."""

from __future__ import annotations

import threading

import pytest

from regraft import CallFailed
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome, SetParameters
from tests.adaptation.parts import Fragile
from tests.adaptation.system import System
from tests.support.waiting import PATIENCE, wait_until


def _hold(system: System) -> AdaptationReport:
    """Begin an adaptation that takes until ``Fragile.release`` is set."""
    assert system.adapt(SetParameters("fragile", {"mood": "hangs"})).outcome is Outcome.APPLIED
    return system.adapt(SetParameters("fragile", {"level": 1}), wait=False)


def test_the_queue_is_bounded(bare_system: System) -> None:
    system = bare_system
    system.start_manager(queue_limit=2, answer_within=5.0)
    _hold(system)
    waiting = [system.adapt(SetParameters("listener", {"gain": g}), wait=False) for g in (0.1, 0.2)]
    assert [report.outcome for report in waiting] == [Outcome.PENDING] * 2
    with pytest.raises(CallFailed, match="queue is full"):
        system.adapt(SetParameters("listener", {"gain": 0.3}), wait=False)
    Fragile.release.set()
    wait_until(lambda: system.lines(id=waiting[-1].id).entries[0].outcome is Outcome.APPLIED)
    assert system.adapt(SetParameters("listener", {"gain": 0.4})).outcome is Outcome.APPLIED
    assert [line.outcome for line in system.lines(limit=4).entries] == [Outcome.APPLIED] * 4


def test_first_come_first_served(bare_system: System) -> None:
    system = bare_system
    system.start_manager(answer_within=5.0)
    _hold(system)
    ids = [system.adapt(SetParameters("listener", {"gain": g}), wait=False).id for g in (0.1, 0.2, 0.3)]
    Fragile.release.set()
    last = system.adapt(SetParameters("fragile", {"level": 2}))
    assert [system.lines(id=i).entries[0].revision_after for i in (*ids, last.id)] == [4, 5, 6, 7]
    assert system.view("listener").parameters["gain"] == 0.3


def test_one_that_named_a_revision_that_became_stale_while_it_waited_is_rejected(bare_system: System) -> None:
    system = bare_system
    system.start_manager(answer_within=5.0)
    _hold(system)
    waiting = system.adapt(SetParameters("listener", {"gain": 0.1}), wait=False, revision=2)
    Fragile.release.set()
    system.adapt(SetParameters("talker", {"rate": 10.0}))
    (line,) = system.lines(id=waiting.id).entries
    assert line.outcome is Outcome.REJECTED


def test_those_that_wait_are_listed_newest_first_until_they_have_a_line(bare_system: System) -> None:
    system = bare_system
    system.start_manager(answer_within=5.0)
    under_way = _hold(system)
    waiting = [system.adapt(SetParameters("listener", {"gain": g}), wait=False) for g in (0.1, 0.2)]
    wait_until(lambda: under_way.id in [line.id for line in system.lines().entries])
    page = system.lines()
    assert [report.id for report in page.waiting] == [report.id for report in reversed(waiting)]
    assert [report.request for report in page.waiting] == [report.request for report in reversed(waiting)]
    assert system.lines(before=waiting[0].id).waiting == ()
    assert system.cancel(page.waiting[0].id).outcome is Outcome.CANCELLED
    assert [report.id for report in system.lines().waiting] == [waiting[0].id]
    Fragile.release.set()
    wait_until(lambda: system.lines(id=waiting[0].id).entries[0].outcome is Outcome.APPLIED)
    assert system.lines().waiting == ()


def test_one_that_waits_can_be_cancelled(bare_system: System) -> None:
    system = bare_system
    system.start_manager(answer_within=5.0)
    _hold(system)
    waiting = system.adapt(SetParameters("listener", {"gain": 0.1}), wait=False)
    cancelled = system.cancel(waiting.id)
    assert (cancelled.id, cancelled.outcome) == (waiting.id, Outcome.CANCELLED)
    Fragile.release.set()
    system.adapt(SetParameters("fragile", {"level": 2}))
    assert system.view("listener").parameters["gain"] == 0.5
    assert system.lines(id=waiting.id).entries[0].outcome is Outcome.CANCELLED


def test_one_under_way_is_cancelled_between_two_steps_and_undone(bare_system: System) -> None:
    system = bare_system
    system.start_manager(answer_within=5.0)
    system.adapt(SetParameters("fragile", {"mood": "hangs"}))
    before = system.views()
    running = system.adapt(
        SetParameters("listener", {"gain": 0.1}),
        SetParameters("fragile", {"level": 1}),
        SetParameters("talker", {"rate": 10.0}),
        wait=False,
    )
    wait_until(lambda: system.running["fragile"].runtime.parameters.values["level"] == 1)
    cancelled: list[AdaptationReport] = []
    asking = threading.Thread(target=lambda: cancelled.append(system.cancel(running.id)))
    asking.start()
    line = system.running["manager"].component._queue
    wait_until(lambda: line.serving and line.serving.cancelled)
    Fragile.release.set()
    asking.join(PATIENCE)
    assert cancelled[0].outcome is Outcome.CANCELLED, cancelled
    assert system.views() == before


def test_an_ended_adaptation_cannot_be_cancelled_and_says_how_it_ended(system: System) -> None:
    report = system.adapt(SetParameters("listener", {"gain": 0.1}))
    assert system.cancel(report.id) == report
    with pytest.raises(CallFailed, match="no adaptation '99'"):
        system.cancel("99")
