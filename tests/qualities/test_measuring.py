"""The kit measures at the class's own rate; only what fits counts, and each problem is reported once."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.health import Diagnostic, Level
from regraft.bus_schema.model.lifecycle import Transition
from regraft.testing import Rig
from tests.qualities.parts import Gauge, Plain


@pytest.fixture
def rig() -> Iterator[Rig]:
    with Rig(start=0.3) as made:
        yield made


def kinds(rig: Rig) -> list[str]:
    """Return the kinds of the events about qualities."""
    return [event.kind for event in rig.events if event.kind.startswith("quality.")]


def test_measurements_are_taken_at_whole_multiples_of_the_period(rig: Rig) -> None:
    published = rig.collect_qualities("gauge")
    rig.add(Gauge)
    rig.advance(1.2)
    assert [each.stamp for each in published] == [0.5, 1.0, 1.5]
    assert [(each.component, each.incarnation, each.period) for each in published] == [("gauge", 1, 0.5)] * 3


def test_only_an_active_component_measures(rig: Rig) -> None:
    published = rig.collect_qualities("gauge")
    rig.add(Gauge)
    rig.transition("gauge", Transition.DEACTIVATE)
    rig.advance(2.0)
    assert published == []
    rig.transition("gauge", Transition.ACTIVATE)
    rig.advance(0.5)
    assert len(published) == 1


@pytest.mark.parametrize(("mood", "value"), [("fine", 0.5), ("whole", 1.0), ("array's", 0.25)])
def test_a_number_in_the_range_counts(rig: Rig, mood: str, value: float) -> None:
    published = rig.collect_qualities("gauge")
    rig.add(Gauge, parameters={"mood": mood})
    rig.advance(0.5)
    assert [(each.values, each.unknown) for each in published] == [({"level": value}, {})]
    assert kinds(rig) == []


@pytest.mark.parametrize(
    ("mood", "why"),
    [
        ("nan", "nan: must be finite"),
        ("infinite", "inf: must be finite"),
        ("text", "a value of type str: must be a number"),
        ("yes", "a value of type bool: must be a number"),
        ("list", "a value of type list: must be a number"),
        ("none", "a value of type NoneType: must be a number"),
        ("complex", "a value of type complex: must be a number"),
        ("too much", "1.5: must be at most 1 m"),
        ("too little", "-0.1: must be at least 0 m"),
        ("no map", "a value of type list for all: must be a map of numbers by name"),
        ("raises", "evaluate raised RuntimeError: the gauge is broken"),
        ("huge", "evaluate raised OverflowError: int too large to convert to float"),
        ("unprintable", "evaluate raised RuntimeError: cannot be shown"),
    ],
)
def test_what_does_not_fit_is_unknown_and_reported_once(rig: Rig, mood: str, why: str) -> None:
    published = rig.collect_qualities("gauge")
    rig.add(Gauge, parameters={"mood": mood})
    rig.advance(1.2)
    assert [(each.values, each.unknown) for each in published] == [({}, {"level": why})] * 3
    (event,) = [event for event in rig.events if event.kind == "quality.unknown"]
    assert event.text == f"the quality 'level' is unknown: {why}"
    assert event.details == {"qualities": ["level"], "why": why}


def test_what_is_left_out_is_unknown_without_a_fault(rig: Rig) -> None:
    published = rig.collect_qualities("gauge")
    rig.add(Gauge, parameters={"mood": "left out"})
    rig.advance(5.0)
    assert published[0].unknown == {"level": "not given"}
    assert kinds(rig) == []


def test_an_undeclared_name_is_reported_with_the_nearest_and_harms_nothing(rig: Rig) -> None:
    published = rig.collect_qualities("gauge")
    rig.add(Gauge, parameters={"mood": "undeclared"})
    rig.advance(5.0)
    assert published[-1].values == {"level": 0.5}
    (event,) = [event for event in rig.events if event.kind.startswith("quality.")]
    assert event.text == "the quality 'levle' is unknown: not declared; did you mean 'level'?"


def test_a_component_without_any_known_quality_has_a_fault_after_a_while_until_it_is_over(rig: Rig) -> None:
    told: list[Diagnostic] = []
    rig.bus.subscribe(rig.keys.diagnostics, lambda sample: told.append(codec.decode(sample.payload, Diagnostic)))
    rig.add(Gauge, parameters={"mood": "raises"})
    rig.advance(5.0)
    assert kinds(rig) == ["quality.unknown", "quality.fault"]
    assert [each.level for each in told if each.subject == "qualities"] == [Level.WARNING, Level.ERROR]
    rig.runtimes["gauge"].parameters.set({"mood": "fine"})
    rig.advance(1.0)
    assert told[-1].level is Level.OK
    rig.runtimes["gauge"].parameters.set({"mood": "nan"})
    rig.advance(1.0)
    assert kinds(rig) == ["quality.unknown", "quality.fault", "quality.unknown"]


def test_a_problem_that_comes_and_goes_is_an_event_now_and_then(rig: Rig) -> None:
    rig.add(Gauge)
    for _ in range(10):
        for mood in ("nan", "fine"):
            rig.runtimes["gauge"].parameters.set({"mood": mood})
            rig.advance(0.5)
    assert kinds(rig) == ["quality.unknown"] * 2


def test_a_class_without_qualities_publishes_none_and_wakes_for_none(rig: Rig) -> None:
    published = rig.collect_qualities("plain")
    rig.add(Plain)
    rig.advance(3.0)
    assert published == []
    assert rig.runtimes["plain"].timers.next_due() is None
