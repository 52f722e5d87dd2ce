"""Nodes that depend on the time, on a clock that the test moves."""

import pytest

from behavior_tree import FAILURE, RUNNING, SUCCESS, ManualClock
from behavior_tree.scripted import LETTERS
from tests.behavior_tree.trees import leaf, statuses, ticks, tree_of


def test_sleep_runs_until_its_time_has_come() -> None:
    clock = ManualClock(100.0)
    tree = tree_of('<Sleep msec="250"/>', clock=clock)
    assert tree.tick_once() == RUNNING
    assert tree.next_wake_up() == 100.25
    clock.advance(0.249)
    assert tree.tick_once() == RUNNING
    clock.advance_to(100.25)
    assert tree.tick_once() == SUCCESS
    assert tree.next_wake_up() is None


def test_sleep_of_no_time_succeeds_at_once() -> None:
    assert tree_of('<Sleep msec="0"/>').tick_exactly_once() == SUCCESS


def test_halted_sleep_leaves_no_timer_and_starts_anew() -> None:
    clock = ManualClock()
    tree = tree_of('<Sleep msec="100"/>', clock=clock)
    tree.tick_once()
    clock.advance(0.09)
    tree.halt_tree()
    assert tree.next_wake_up() is None
    tree.tick_once()
    clock.advance(0.09)
    assert tree.tick_once() == RUNNING


def test_delay_runs_its_child_only_after_the_delay() -> None:
    clock, events = ManualClock(), list[str]()
    tree = tree_of(f'<Delay delay_msec="100">{leaf("RS")}</Delay>', events=events, clock=clock)
    assert ticks(tree, 2) == "RR"
    assert not events
    clock.advance(0.1)
    assert ticks(tree, 2) == "RS"
    assert events == ["leaf:R", "leaf:S"]


def test_delay_waits_again_after_its_child_completed_but_not_after_a_skip() -> None:
    clock, events = ManualClock(), list[str]()
    tree = tree_of(f'<Delay delay_msec="100">{leaf("KSS")}</Delay>', events=events, clock=clock)
    ticks(tree, 1)
    clock.advance(0.1)
    assert ticks(tree, 3) == "KSR"
    clock.advance(0.1)
    assert ticks(tree, 1) == "S"


def test_delay_that_was_halted_waits_its_whole_time_again() -> None:
    clock = ManualClock()
    tree = tree_of(f'<Delay delay_msec="100">{leaf("S")}</Delay>', clock=clock)
    ticks(tree, 1)
    clock.advance(0.1)
    tree.halt_tree()
    assert ticks(tree, 1) == "R"
    assert tree.next_wake_up() == pytest.approx(0.2)


def test_timeout_halts_a_child_that_takes_too_long_and_fails() -> None:
    clock, events = ManualClock(), list[str]()
    tree = tree_of(f'<Timeout msec="50">{leaf("R")}</Timeout>', events=events, clock=clock)
    assert ticks(tree, 1) == "R"
    assert tree.next_wake_up() == 0.05
    clock.advance(0.05)
    assert ticks(tree, 1) == "F"
    assert events == ["leaf:R", "leaf:H"]
    assert statuses(tree) == "II"


@pytest.mark.parametrize(("script", "result"), [("RS", "S"), ("RF", "F")])
def test_timeout_passes_on_a_child_that_is_quick_enough(script: str, result: str) -> None:
    clock = ManualClock()
    tree = tree_of(f'<Timeout msec="50">{leaf(script)}</Timeout>', clock=clock)
    ticks(tree, 1)
    clock.advance(0.049)
    assert ticks(tree, 1) == result
    assert tree.next_wake_up() is None


def test_timeout_measures_each_start_anew() -> None:
    clock = ManualClock()
    tree = tree_of(f'<Timeout msec="50">{leaf("RSRR")}</Timeout>', clock=clock)
    assert ticks(tree, 2) == "RS"
    clock.advance(0.04)
    assert ticks(tree, 1) == "R"
    clock.advance(0.04)
    assert ticks(tree, 1) == "R"
    clock.advance(0.01)
    assert ticks(tree, 1) == "F"


def test_timeout_of_zero_never_ends() -> None:
    clock = ManualClock()
    tree = tree_of(f'<Timeout msec="0">{leaf("R")}</Timeout>', clock=clock)
    ticks(tree, 1)
    clock.advance(1e6)
    assert ticks(tree, 1) == "R"
    assert tree.next_wake_up() is None


def test_earliest_of_several_timers_wakes_the_tree() -> None:
    clock = ManualClock()
    tree = tree_of('<Parallel><Sleep msec="300"/><Sleep msec="100"/><Sleep msec="200"/></Parallel>', clock=clock)
    wake_ups = []
    while tree.tick_once() == RUNNING:
        due = tree.next_wake_up()
        assert due is not None
        wake_ups.append(due)
        clock.advance_to(due)
    assert wake_ups == [0.1, 0.2, 0.3]


def test_retry_around_a_sleep_needs_no_time_but_that_of_the_sleeps() -> None:
    clock = ManualClock()
    failing = '<Inverter><Sleep msec="100"/></Inverter>'
    tree = tree_of(f'<RetryUntilSuccessful num_attempts="3">{failing}</RetryUntilSuccessful>', clock=clock)
    results = []
    while (status := tree.tick_once()) == RUNNING:
        results.append(LETTERS[status])
        clock.advance_to(tree.next_wake_up() or clock.now())
    assert status == FAILURE
    assert clock.now() == pytest.approx(0.3)


def test_timeout_that_comes_due_while_the_child_does_not_run_has_no_effect() -> None:
    clock = ManualClock()
    tree = tree_of(f'<Timeout msec="50">{leaf("KRS")}</Timeout>', clock=clock)
    assert ticks(tree, 1) == "K"
    clock.advance(0.05)
    assert ticks(tree, 2) == "RS"
