"""Ticks stop at breakpoints, results are forced there, and nothing else of a tree changes."""

from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behavior_tree import (
    FAILURE,
    RUNNING,
    SUCCESS,
    Breakpoint,
    Breakpoints,
    ManualClock,
    Position,
    Status,
    Stop,
    Tree,
    TreeObserver,
    load_text,
)
from behavior_tree.errors import TreeError
from behavior_tree.scripted import LETTERS, scripted_registry
from tests.behavior_tree.random_trees import TreeMaker
from tests.behavior_tree.trees import leaf, tree_of

BEFORE, AFTER = Position.BEFORE, Position.AFTER


class Stops:
    """Notes where a tree stops, and forces results there."""

    def __init__(self, tree: Tree, **forced: Status) -> None:
        self.tree = tree
        self.seen: list[str] = []
        self.forced = forced
        self.points = Breakpoints(tree, self._stop)

    def at(self, path: str, position: Position = BEFORE, result: Status | None = None, *, once: bool = False) -> None:
        """Set a breakpoint at the node with a path."""
        self.points.set(Breakpoint(self.tree.node(path).uid, position, result, once))

    def _stop(self, stop: Stop) -> Status | None:
        result = "" if stop.result is None else LETTERS[stop.result]
        self.seen.append(f"{stop.position.value} {stop.node.path} {result}".strip())
        return self.forced.get(stop.node.path)


def pair(first: str = "S", second: str = "S", **attributes: str) -> Tree:
    return tree_of(f"<Sequence>{leaf(first, 'a', **attributes)}{leaf(second, 'b')}</Sequence>")


def test_a_tick_stops_before_and_after_a_node() -> None:
    stops = Stops(pair("RS"))
    stops.at("a", BEFORE)
    stops.at("a", AFTER)
    assert stops.tree.tick_exactly_once() == RUNNING
    assert stops.tree.tick_exactly_once() == SUCCESS
    assert stops.seen == ["before a", "after a R", "before a", "after a S"]


def test_a_result_that_is_forced_before_a_node_keeps_it_from_running() -> None:
    events: list[str] = []
    tree = tree_of(f"<Sequence>{leaf('S', 'a')}{leaf('S', 'b')}</Sequence>", events=events)
    stops = Stops(tree, a=FAILURE)
    stops.at("a")
    assert tree.tick_exactly_once() == FAILURE
    assert (stops.seen, events) == (["before a"], [])


def test_a_result_that_is_forced_after_a_node_replaces_its_own() -> None:
    stops = Stops(pair("F"), a=SUCCESS)
    stops.at("a", AFTER)
    assert stops.tree.tick_exactly_once() == SUCCESS


@pytest.mark.parametrize("position", list(Position))
def test_a_breakpoint_with_a_result_forces_it_without_a_stop(position: Position) -> None:
    stops = Stops(pair())
    stops.at("b", position, FAILURE)
    assert stops.tree.tick_exactly_once() == FAILURE
    assert stops.seen == []


def test_a_breakpoint_for_once_is_gone_when_it_was_reached() -> None:
    stops = Stops(pair())
    stops.at("a", once=True)
    assert [stops.tree.tick_exactly_once() for _ in range(2)] == [SUCCESS, SUCCESS]
    assert (stops.seen, stops.points.all) == (["before a"], ())


def test_stepping_stops_before_every_node_that_runs() -> None:
    stops = Stops(pair("F"))
    stops.points.stepping = True
    stops.tree.tick_exactly_once()
    assert stops.seen == ["before Sequence::1", "before a"]
    stops.points.stepping = False
    stops.tree.tick_exactly_once()
    assert len(stops.seen) == 2


def test_what_a_precondition_decides_does_not_stop_before_the_node() -> None:
    stops = Stops(pair(_skipIf="true"))
    stops.at("a")
    assert stops.tree.tick_exactly_once() == SUCCESS
    assert stops.seen == []


def test_what_a_precondition_decides_stops_after_the_node_and_may_be_forced() -> None:
    stops = Stops(pair(_skipIf="true"), a=FAILURE)
    stops.at("a", AFTER)
    assert stops.tree.tick_exactly_once() == FAILURE
    assert stops.seen == ["after a K"]


def test_post_conditions_run_with_a_result_that_is_forced_before_a_node() -> None:
    stops = Stops(tree_of(leaf("S", "a", _onFailure="failed := 1")), a=FAILURE)
    stops.at("a")
    assert stops.tree.tick_exactly_once() == FAILURE
    assert stops.tree.blackboard.get("failed") == 1


def test_removed_breakpoints_stop_nobody() -> None:
    stops = Stops(pair())
    stops.at("a")
    stops.at("b", AFTER)
    assert stops.points.remove(stops.tree.node("a").uid, BEFORE)
    assert not stops.points.remove(stops.tree.node("a").uid, BEFORE)
    assert [each.position for each in stops.points.all] == [AFTER]
    stops.points.clear()
    stops.tree.tick_exactly_once()
    assert stops.seen == []


def test_a_node_that_is_not_there_and_a_status_that_cannot_be_forced_are_refused() -> None:
    stops = Stops(pair())
    with pytest.raises(ValueError, match="there is no node 9; there are 1 to 3"):
        stops.points.set(Breakpoint(9))
    with pytest.raises(ValueError, match="RUNNING cannot be forced"):
        stops.points.set(Breakpoint(1, result=RUNNING))
    assert stops.points.all == ()


def test_forced_results_are_counted_and_either_may_be_removed_first() -> None:
    stops = Stops(pair())
    stops.at("a", BEFORE, FAILURE)
    observer = TreeObserver(stops.tree)
    stops.at("b", AFTER)
    stops.tree.tick_exactly_once()
    assert (observer.counts[1].ticks, observer.counts[1].failures) == (1, 1)
    stops.points.clear()
    stops.tree.tick_exactly_once()
    assert (observer.counts[1].ticks, observer.counts[1].successes) == (2, 1)
    observer.detach()
    stops.at("a")
    stops.tree.tick_exactly_once()
    assert stops.seen == ["before a"]


@given(number=st.integers(0, 10**9))
@settings(max_examples=60, deadline=None)
def test_stopping_everywhere_changes_no_status_and_no_event(number: int) -> None:
    assert _run(number, stop=True) == _run(number, stop=False)


def _run(number: int, *, stop: bool) -> list[str]:
    events: list[str] = []
    clock = ManualClock()
    try:
        tree = load_text(TreeMaker(Random(number)).document(), scripted_registry(events), clock=clock)
        tree.add_transition_hook(lambda uid, before, after, time: events.append(f"{uid} {before}{after} {time}"))
        if stop:
            points = Breakpoints(tree, lambda _: None)
            points.stepping = True
            for node in tree.nodes:
                points.set(Breakpoint(node.uid, AFTER))
        for _ in range(8):
            events.append(LETTERS[tree.tick_once(20)])
            clock.advance(0.05)
    except TreeError as error:
        events.append(str(error))
    return events
