"""Change of connection."""

from __future__ import annotations

from functools import partial
from typing import Any

from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import Connect, Outcome, SetParameters
from tests.adaptation.system import System
from tests.support.waiting import wait_until


def _runs_without_holes(log: list[tuple[str, int]], source: str) -> list[list[int]]:
    """Return the numbers heard of one source, cut wherever another source was heard in between."""
    runs: list[list[int]] = []
    last = None
    for who, number in list(log):
        if who == source:
            if last != source:
                runs.append([])
            runs[-1].append(number)
        last = who
    return runs


def _hears(listener: Any, since: int, source: str) -> bool:
    return source in {who for who, _ in listener.log[since:]}


def _hears_more(listener: Any, since: int) -> bool:
    return len(listener.log) > since


def _heard_of(source: str, listeners: list[Any]) -> list[int]:
    return [n for listener in listeners for who, n in list(listener.log) if who == source]


def _have_heard(listeners: list[Any], source: str, numbers: set[int]) -> bool:
    return numbers <= {*_heard_of(source, listeners)}


def _each_is_contiguous(runs: list[list[int]]) -> bool:
    return all(run == list(range(run[0], run[0] + len(run))) for run in runs)


def test_connecting_an_input_back_and_forth_loses_and_doubles_nothing(system: System) -> None:
    listener = system.running["listener"].component
    for _ in range(20):
        for topic, source in (("others", "other"), ("numbers", "talker")):
            report = system.adapt(Connect("listener", "heard", topic))
            assert report.outcome is Outcome.APPLIED, report
            heard = len(listener.log)
            wait_until(partial(_hears, listener, heard, source))
    for source in ("talker", "other"):
        runs = _runs_without_holes(listener.log, source)
        assert len(runs) == 20 + (source == "talker")
        assert _each_is_contiguous(runs)
    assert not [event for event in system.events if event.kind == "message.lost"]


def test_two_outputs_that_change_places_lose_and_double_nothing(system: System) -> None:
    listeners = [system.running[name].component for name in ("listener", "second")]
    topics = ["numbers", "others"]
    for _ in range(10):
        topics.reverse()
        report = system.adapt(Connect("talker", "numbers", topics[0]), Connect("other", "numbers", topics[1]))
        assert report.outcome is Outcome.APPLIED, report
        heard = [len(listener.log) for listener in listeners]
        for listener, count in zip(listeners, heard, strict=True):
            wait_until(partial(_hears_more, listener, count))
    for source in ("talker", "other"):
        first = next(n for who, n in listeners[source == "other"].log if who == source)
        said = {*range(first, system.running[source].component.sent + 1)}
        wait_until(partial(_have_heard, listeners, source, said), "all that was said so far to be heard")
        everywhere = sorted(_heard_of(source, listeners))
        assert everywhere == list(range(first, first + len(everywhere)))


def test_a_silent_source_is_connected_too(system: System) -> None:
    assert system.adapt(SetParameters("other", {"rate": 0.0})).outcome is Outcome.APPLIED
    report = system.adapt(Connect("fragile", "heard", "others"))
    assert report.outcome is Outcome.APPLIED, report
    assert system.view("fragile").connections["heard"] == "others"


def test_a_dead_old_source_does_not_hold_up_the_switch(system: System) -> None:
    system.running["talker"].kill()
    system.host.ended("talker", ProcessState.QUARANTINED)
    report = system.adapt(Connect("listener", "heard", "others"))
    assert report.outcome is Outcome.APPLIED, report
    log = system.running["listener"].component.log
    heard = len(log)
    wait_until(lambda: "other" in {who for who, _ in log[heard:]})


def test_a_wrong_topic_type_and_an_unknown_port_are_both_named(system: System) -> None:
    before = system.views()
    report = system.adapt(Connect("listener", "heard", "scan"), Connect("listener", "nose", "others"))
    assert report.outcome is Outcome.REJECTED
    text = " ".join(violation.problem for violation in report.violations)
    assert "regraft/Twist" in text
    assert "regraft/LaserScan" in text
    assert {violation.field for violation in report.violations} >= {"connect.heard", "connect.nose"}
    assert system.views() == before


def test_starving_a_required_input_is_rejected(system: System) -> None:
    report = system.adapt(Connect("listener", "heard", "spare"))
    assert report.outcome is Outcome.REJECTED
    assert [violation.change for violation in report.violations] == [0]


def test_changes_that_only_fit_together_are_accepted_together(system: System) -> None:
    report = system.adapt(Connect("other", "numbers", "spare"), Connect("second", "heard", "spare"))
    assert report.outcome is Outcome.APPLIED, report
