"""A tree as its executor sees it: ticking, waking, watching, and the board from outside."""

import pytest

from behavior_tree import (
    FAILURE,
    IDLE,
    RUNNING,
    SUCCESS,
    Blackboard,
    ManualClock,
    NodeError,
    Registry,
    Status,
    load_text,
    status_from_name,
    status_name,
)
from tests.behavior_tree.trees import document, leaf, plain_registry, statuses, ticks, tree_of

RETRY = "<RetryUntilSuccessful num_attempts='3'><ScriptedSync name='n' script='FFS'/></RetryUntilSuccessful>"


def test_synchronous_retries_take_three_exact_ticks_but_one_tick_of_the_tree() -> None:
    assert ticks(tree_of(RETRY), 3) == "RRS"
    assert tree_of(RETRY).tick_once() == SUCCESS


def test_endless_wake_ups_can_be_bounded_and_stay_pending() -> None:
    clock = ManualClock(5.0)
    tree = tree_of("<Repeat num_cycles='-1'><Script code='n += 1'/></Repeat>", clock=clock)
    tree.blackboard.set("n", 0)
    assert tree.tick_once(max_ticks=10) == RUNNING
    assert tree.blackboard.get("n") == 10
    assert tree.next_wake_up() == 5.0


def test_asynchronous_sequence_lets_the_tree_react_between_two_children() -> None:
    body = "<{0}><Script code='n += 1'/><Script code='n += 1'/></{0}>"
    for node, expected in (("Sequence", 2), ("AsyncSequence", 1)):
        tree = tree_of(body.format(node))
        tree.blackboard.set("n", 0)
        tree.tick_exactly_once()
        assert tree.blackboard.get("n") == expected


def test_wake_up_from_outside_leads_to_one_more_tick() -> None:
    events: list[str] = []
    tree = tree_of(leaf("R"), events=events)
    tree.tick_once()
    tree.request_wake_up()
    assert tree.next_wake_up() is not None
    tree.tick_once()
    tree.tick_once()
    assert len(events) == 4
    assert tree.next_wake_up() is None


def test_completed_tree_is_idle_and_starts_anew() -> None:
    tree = tree_of(leaf("SF"))
    assert tree.tick_once() == SUCCESS
    assert tree.status == IDLE
    assert tree.tick_once() == FAILURE


def test_every_change_of_a_stored_status_is_announced_with_its_time() -> None:
    seen: list[tuple[int, str, str, float]] = []

    def watch(uid: int, previous: Status, status: Status, time: float) -> None:
        seen.append((uid, status_name(previous), status_name(status), time))

    clock = ManualClock(2.0)
    tree = tree_of(f"<Sequence>{leaf('S', 'a')}{leaf('RK', 'b')}</Sequence>", clock=clock)
    tree.add_transition_hook(watch)
    tree.tick_once()
    assert seen == [
        (1, "IDLE", "RUNNING", 2.0),
        (2, "IDLE", "SUCCESS", 2.0),
        (3, "IDLE", "RUNNING", 2.0),
    ]
    seen.clear()
    clock.advance(1.0)
    tree.halt_tree()
    assert seen == [
        (2, "SUCCESS", "IDLE", 3.0),
        (3, "RUNNING", "IDLE", 3.0),
        (1, "RUNNING", "IDLE", 3.0),
    ]
    tree.remove_transition_hook(watch)
    tree.tick_once()
    assert len(seen) == 3


def test_announced_transitions_add_up_to_the_stored_statuses() -> None:
    tree = tree_of(
        f"<ReactiveFallback>{leaf('FRKS', 'a')}<Sequence>{leaf('SRF', 'b')}{leaf('RS', 'c')}</Sequence>"
        f"<Repeat num_cycles='2'>{leaf('RS', 'd')}</Repeat></ReactiveFallback>"
    )
    stored = dict.fromkeys((node.uid for node in tree.nodes), IDLE)

    def follow(uid: int, previous: Status, status: Status, _time: float) -> None:
        assert stored[uid] == previous
        stored[uid] = status

    tree.add_transition_hook(follow)
    for _ in range(40):
        tree.tick_once()
        assert stored == {node.uid: node.status for node in tree.nodes}


def test_board_is_read_and_written_from_outside_between_ticks() -> None:
    tree = tree_of("<ReactiveSequence><ScriptCondition code='battery &gt; 20'/>" + leaf("R") + "</ReactiveSequence>")
    tree.blackboard.set("battery", 80.0)
    assert ticks(tree, 1) == "R"
    tree.blackboard.set("battery", 10)
    assert ticks(tree, 1) == "F"
    assert tree.blackboard.dump() == {"battery": 10.0}


def test_tree_may_run_on_a_board_that_exists_already() -> None:
    board = Blackboard()
    board.set("x", 1)
    tree = load_text(document("<Script code='x = x + 1'/>"), plain_registry(), blackboard=board)
    tree.tick_once()
    assert board.get("x") == 2


def test_error_leaves_the_tree_as_it_is() -> None:
    tree = tree_of(f"<Parallel>{leaf('R', 'a')}<Script name='bad' code='x = 1'/></Parallel>")
    with pytest.raises(NodeError, match="'bad'"):
        tree.tick_once()
    assert statuses(tree) == "RRI"


def test_two_trees_of_one_registry_share_nothing() -> None:
    registry = Registry()
    text = document("<RunOnce then_skip='false'><Script code='x := 1'/></RunOnce>")
    first, second = load_text(text, registry), load_text(text, registry)
    first.tick_once()
    assert second.blackboard.dump() == {}
    assert second.tick_once() == SUCCESS


def test_statuses_have_names() -> None:
    assert status_from_name(" RUNNING ") == RUNNING
    assert status_name(RUNNING) == "RUNNING"
    with pytest.raises(ValueError, match="'DONE' is not a status; use one of IDLE"):
        status_from_name("DONE")
