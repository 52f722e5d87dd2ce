"""An observer counts what nodes do and changes nothing of it."""

from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st

from behavior_tree import FAILURE, IDLE, RUNNING, SUCCESS, ManualClock, Node, NodeError, Status, TreeObserver, load_text
from behavior_tree.errors import TreeError
from behavior_tree.scripted import LETTERS, scripted_registry
from tests.behavior_tree.random_trees import TreeMaker
from tests.behavior_tree.trees import leaf, statuses, tree_of


def test_ticks_results_and_changes_are_counted() -> None:
    tree = tree_of(f"<Sequence>{leaf('RSF', 'a')}{leaf('FS', 'b', _skipIf='skip == 1')}</Sequence>")
    tree.blackboard.set("skip", 0)
    observer = TreeObserver(tree)
    for _ in range(2):
        tree.tick_exactly_once()
    sequence, first, second = observer.counts
    assert (first.ticks, first.successes, first.failures, first.transitions) == (2, 1, 0, 2)
    assert (second.ticks, second.failures, second.last_result) == (1, 1, FAILURE)
    assert sequence.results == {1: 1, 3: 1}


def test_a_skipped_node_is_counted_although_its_status_is_not_stored() -> None:
    tree = tree_of(f"<Sequence>{leaf('S', 'a', _skipIf='true')}{leaf('S', 'b')}</Sequence>")
    observer = TreeObserver(tree)
    tree.tick_exactly_once()
    skipped = observer.counts[1]
    assert (skipped.ticks, skipped.skips, skipped.transitions, skipped.last_result) == (1, 1, 0, IDLE)


def test_a_status_that_stays_the_same_counts_as_one_change_and_many_ticks() -> None:
    tree = tree_of(leaf("RRRS"))
    observer = TreeObserver(tree)
    for _ in range(3):
        tree.tick_exactly_once()
    counts = observer.counts[0]
    assert (counts.ticks, counts.results[RUNNING], counts.transitions) == (3, 3, 1)


def test_a_tick_that_raises_an_error_is_counted() -> None:
    tree = tree_of("<Sequence><Script code='x = 1'/></Sequence>")
    observer = TreeObserver(tree)
    for expected in (1, 2):
        try:
            tree.tick_exactly_once()
        except NodeError:
            tree.halt_tree()
        assert [counts.ticks for counts in observer.counts] == [expected, expected]


def test_the_time_of_the_last_change_is_that_of_the_trees_clock() -> None:
    clock = ManualClock()
    tree = tree_of("<Sleep msec='500'/>", clock=clock)
    observer = TreeObserver(tree)
    assert observer.counts[0].last_time is None
    clock.advance(2.0)
    tree.tick_exactly_once()
    clock.advance(0.25)
    tree.tick_exactly_once()
    assert observer.counts[0].last_time == 2.0


def test_counting_begins_again_from_zero_when_it_is_asked_to() -> None:
    tree = tree_of(leaf("S"))
    observer = TreeObserver(tree)
    tree.tick_exactly_once()
    observer.reset()
    assert (observer.counts[0].ticks, observer.counts[0].transitions) == (0, 0)
    tree.tick_exactly_once()
    assert observer.counts[0].ticks == 1


def test_hooks_that_were_there_are_asked_while_it_counts_and_afterwards() -> None:
    tree = tree_of(f"<Sequence>{leaf('F')}</Sequence>")
    asked: list[int] = []

    def succeed(node: Node) -> Status:
        asked.append(node.uid)
        return SUCCESS

    tree.nodes[1].set_hooks(pre_tick=succeed)
    observer = TreeObserver(tree)
    assert tree.tick_exactly_once() == SUCCESS
    assert observer.counts[1].successes == 1
    observer.detach()
    assert tree.tick_exactly_once() == SUCCESS
    assert observer.counts[1].ticks == 1
    assert asked == [2, 2]
    assert tree.nodes[0].pre_tick_hook is None


@settings(max_examples=60)
@given(st.integers(0, 2**32))
def test_an_observed_tree_does_what_it_does_unobserved(seed: int) -> None:
    xml = TreeMaker(Random(seed)).document()
    plain, observed = (_trace(xml, observe) for observe in (False, True))
    assert observed == plain


def _trace(xml: str, observe: bool) -> list[str]:
    events: list[str] = []
    try:
        tree = load_text(xml, scripted_registry(events), clock=ManualClock())
        if observe:
            TreeObserver(tree)
        seen = []
        for _ in range(8):
            result = LETTERS[tree.tick_once(100)]
            seen.append(f"{result} {statuses(tree)} {events} {tree.blackboard.dump()}")
    except TreeError as error:
        return [f"{type(error).__name__}: {error}", *events]
    return seen
