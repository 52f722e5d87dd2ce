"""Actions that are written as one function."""

from collections.abc import Callable
from typing import Any

import pytest

from behavior_tree import (
    FAILURE,
    IDLE,
    RUNNING,
    SKIPPED,
    SUCCESS,
    CoroutineAction,
    ManualClock,
    NodeError,
    NodeSetup,
    Output,
    Registry,
    Steps,
    Tree,
    load_text,
)
from tests.behavior_tree.trees import document, ticks

Course = Callable[["Errand"], Steps]


class Errand(CoroutineAction):
    """Runs what the test gives it."""

    progress = Output(int)

    def __init__(self, setup: NodeSetup, course: Course, log: list[str]) -> None:
        super().__init__(setup)
        self._course = course
        self.log = log

    def run(self) -> Steps:
        return self._course(self)


def tree_of_errand(course: Course, log: list[str] | None = None, clock: ManualClock | None = None) -> Tree:
    registry = Registry()
    registry.register(Errand, course=course, log=log if log is not None else [])
    return load_text(document("<Errand name='errand' progress='{p}'/>"), registry, clock=clock or ManualClock())


def in_three_ticks(errand: Errand) -> Steps:
    errand.log.append("begin")
    try:
        for number in range(2):
            errand.progress = number
            yield
        errand.log.append("end")
    finally:
        errand.log.append("tidy")
    return FAILURE


def test_function_goes_on_where_it_yielded() -> None:
    log: list[str] = []
    tree = tree_of_errand(in_three_ticks, log)
    assert ticks(tree, 3) == "RRF"
    assert tree.blackboard.get("p") == 1
    assert log == ["begin", "end", "tidy"]
    assert ticks(tree, 1) == "R"
    assert log[3:] == ["begin"]


def test_halt_closes_the_function_which_tidies_up_once() -> None:
    log: list[str] = []
    tree = tree_of_errand(in_three_ticks, log)
    ticks(tree, 1)
    tree.halt_tree()
    tree.halt_tree()
    assert log == ["begin", "tidy"]
    assert tree.root.status == IDLE


@pytest.mark.parametrize(("result", "letter"), [(None, "S"), (SUCCESS, "S"), (FAILURE, "F"), (SKIPPED, "K")])
def test_function_returns_the_result(result: Any, letter: str) -> None:
    def course(_errand: Errand) -> Steps:
        if result == RUNNING:
            yield
        return result  # type: ignore[no-any-return]

    assert ticks(tree_of_errand(course), 1) == letter


@pytest.mark.parametrize("result", [True, RUNNING, IDLE, "SUCCESS", 7])
def test_other_results_are_errors(result: Any) -> None:
    def course(_errand: Errand) -> Steps:
        yield
        return result  # type: ignore[no-any-return]

    tree = tree_of_errand(course)
    tree.tick_once()
    with pytest.raises(NodeError, match="return SUCCESS, FAILURE or SKIPPED"):
        tree.tick_once()


def test_function_waits_on_the_trees_clock() -> None:
    def course(errand: Errand) -> Steps:
        yield from errand.wait(0.5)
        yield from errand.wait(0.25)
        return SUCCESS

    clock = ManualClock(10.0)
    tree = tree_of_errand(course, clock=clock)
    times = []
    while tree.tick_once() == RUNNING:
        due = tree.next_wake_up()
        assert due is not None
        times.append(due)
        clock.advance_to(due)
    assert times == [10.5, 10.75]
    tree.tick_once()
    tree.halt_tree()
    assert tree.next_wake_up() is None


def test_function_that_fails_is_named_and_the_tree_can_go_on() -> None:
    def course(errand: Errand) -> Steps:
        yield
        if not errand.log:
            errand.log.append("failed")
            raise OSError("no road")
        return SUCCESS

    tree = tree_of_errand(course)
    tree.tick_once()
    with pytest.raises(NodeError, match=r"'errand'.*no road"):
        tree.tick_once()
    tree.halt_tree()
    assert ticks(tree, 2) == "RS"


def test_function_that_never_yields_or_yields_something_is_an_error_that_says_so() -> None:
    def plain(_errand: Errand) -> Any:
        return SUCCESS

    def talkative(_errand: Errand) -> Any:
        yield RUNNING

    with pytest.raises(NodeError, match="no yield in it; write a SyncAction"):
        tree_of_errand(plain).tick_once()
    with pytest.raises(NodeError, match="yield nothing, and return the result"):
        tree_of_errand(talkative).tick_once()


def test_function_that_will_not_end_is_reported_when_it_is_halted() -> None:
    def stubborn(_errand: Errand) -> Steps:
        try:
            yield
        except GeneratorExit:
            yield
        return SUCCESS

    tree = tree_of_errand(stubborn)
    tree.tick_once()
    with pytest.raises(NodeError, match="ignored GeneratorExit"):
        tree.halt_tree()
    assert tree.root.status == IDLE


def test_tree_is_ticked_while_it_runs_and_sleeps_until_its_timers() -> None:
    def course(errand: Errand) -> Steps:
        yield from errand.wait(0.25)
        return SUCCESS

    clock, slept = ManualClock(), list[float]()

    def sleep(seconds: float) -> None:
        slept.append(round(seconds, 6))
        clock.advance(seconds)

    assert tree_of_errand(course, clock=clock).tick_while_running(sleep, period_s=0.1) == SUCCESS
    assert slept == [0.1, 0.1, 0.05]


def test_ticking_while_running_ends_with_a_skip_too_and_endless_loops_can_be_bounded() -> None:
    def skips(_errand: Errand) -> Steps:
        yield
        return SKIPPED

    assert tree_of_errand(skips).tick_while_running(lambda _seconds: None) == SKIPPED
    body = "<Repeat num_cycles='25'><AlwaysSuccess/></Repeat>"
    naps: list[float] = []
    tree = load_text(document(body), Registry(), clock=ManualClock())
    assert tree.tick_while_running(naps.append, max_ticks=10) == SUCCESS
    assert naps == [0.0, 0.0]
