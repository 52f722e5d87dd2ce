"""Designs that failed rest: longer each time, for one objective, until what is to blame recovers."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Resting
from tests.metacontrol.owl import NAVIGATE, PERFORMANCE, SAFETY, design, iri, write
from tests.metacontrol.reasoning.cycle import Cycle, objective


def test_each_rest_is_twice_as_long_up_to_the_longest() -> None:
    resting, now, seconds = Resting(), 0.0, []
    for _ in range(7):
        rest = resting.add("d", "o", now)
        seconds.append(rest.seconds)
        now = rest.until
    assert seconds == [30, 60, 120, 240, 480, 600, 600]


def test_a_rest_ends_at_its_time() -> None:
    resting = Resting()
    resting.add("d", "o", 100.0)
    assert resting.get("d", "o", 129.9) is not None
    assert resting.get("d", "o", 130.0) is None


def test_a_rest_is_for_one_objective() -> None:
    resting = Resting()
    resting.add("d", "o", 0.0)
    assert resting.get("d", "other", 1.0) is None


def test_a_failure_during_a_rest_does_not_make_it_longer() -> None:
    resting = Resting()
    first = resting.add("d", "o", 0.0, ["a"], "first")
    again = resting.add("d", "o", 1.0, ["b"], "again")
    assert (again.until, again.why, again.blamed) == (first.until, "first", frozenset({"a", "b"}))


def test_after_a_long_time_without_a_failure_a_rest_is_short_again() -> None:
    resting = Resting()
    resting.add("d", "o", 0.0)
    assert resting.add("d", "o", 630.0).until == 630.0 + 60.0
    assert resting.add("d", "o", 690.0 + 600.1).until == 690.0 + 600.1 + 30.0


def test_what_is_to_blame_ends_the_rest_when_it_recovers() -> None:
    resting = Resting()
    resting.add("d", "o", 0.0, ["laser"])
    resting.add("e", "o", 0.0, ["camera"])
    assert resting.recovered(["laser", "battery"]) == {"d"}
    assert [rest.design for rest in resting.all(1.0)] == ["e"]


def test_an_objective_that_has_ended_leaves_no_rest() -> None:
    resting = Resting()
    resting.add("d", "o", 0.0)
    resting.forget("o")
    assert resting.all(1.0) == ()
    assert resting.add("d", "o", 2.0).until == 32.0


def test_a_first_rest_longer_than_the_longest_is_refused() -> None:
    with pytest.raises(ValueError, match="must be 0 < first <= longest"):
        Resting(10, 5)


@given(st.lists(st.tuples(st.floats(0, 500), st.sampled_from("de"), st.sampled_from(["", "a", "b"])), max_size=40))
def test_a_rest_is_never_shorter_than_the_first_or_longer_than_the_longest(
    events: list[tuple[float, str, str]],
) -> None:
    resting, now = Resting(), 0.0
    for passed, name, blamed in events:
        now += passed
        if blamed == "b":
            resting.recovered(["a"])
            continue
        rest = resting.add(name, "o", now, [blamed])
        assert 30 <= rest.seconds <= 600
        assert rest.since <= now < rest.until
        assert resting.get(name, "o", now) == rest


def test_a_design_that_promises_too_much_is_tried_rarely(tmp_path: Path) -> None:
    """It breaks its requirement whenever it is grounded: without a memory, it would be selected every other cycle."""
    parts = (design("boaster", NAVIGATE, {PERFORMANCE: 0.9, SAFETY: 0.9}), design("plain", NAVIGATE, {SAFETY: 0.6}))
    cycle = Cycle(write(tmp_path, *parts), objective(bounds={SAFETY: 0.5}, always_improve=True))
    switches, last = 0, None
    for _ in range(300):
        current = cycle.design()
        switches += current != last
        last = current
        if current == "boaster":
            cycle.measure(SAFETY, 0.1)
    assert switches <= 8
    assert iri("boaster") in {rest.design for rest in cycle.resting.all(cycle.now)}


def test_a_design_that_fails_by_itself_rests(tmp_path: Path) -> None:
    parts = (design("first", NAVIGATE, {PERFORMANCE: 0.9}), design("second", NAVIGATE, {PERFORMANCE: 0.1}))
    cycle = Cycle(write(tmp_path, *parts), objective())
    assert cycle.design() == "first"
    cycle.report_error(Status.IN_ERROR_FR)
    assert cycle.design() == "second"
    assert cycle.resting.all(cycle.now)[0].why == "it failed, by rule S9"
    assert cycle.design() == "second", "also when the error is gone with its grounding"
