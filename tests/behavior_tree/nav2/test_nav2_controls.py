"""Nav2's control nodes, row by row, quirks included."""

from collections.abc import Callable
from typing import cast

import pytest

from behavior_tree import LoadError, ManualClock, NodeError, Registry, Tree, load_text
from behavior_tree.nav2 import NAV2_NODES, PauseResumeController, register_nav2
from behavior_tree.scripted import scripted_registry
from regraft.services.bt_executor.leaves.context import LeafContext
from regraft.services.bt_executor.node_types import node_types
from tests.behavior_tree.trees import document, leaf, statuses, ticks


def nav2_tree(body: str, events: list[str] | None = None, clock: ManualClock | None = None) -> Tree:
    registry = scripted_registry(events if events is not None else [])
    assert register_nav2(registry) == ()
    return load_text(document(body), registry, clock=clock or ManualClock())


def of(node: str, *scripts: str, ports: str = "", events: list[str] | None = None) -> Tree:
    """Return a tree of one control node with actions a, b, c … that return the letters of their scripts."""
    children = "".join(leaf(script, name) for script, name in zip(scripts, "abcd", strict=False))
    return nav2_tree(f"<{node} {ports}>{children}</{node}>", events)


@pytest.mark.parametrize(
    ("scripts", "results", "expected"),
    [
        (("S", "RRS", "S"), "RRS", "a:S b:R b:R b:S c:S"),
        (("S", "F"), "F", "a:S b:F"),
        (("F", "S"), "F", "a:F"),
        (("K", "K"), "K", "a:K b:K"),
        (("K", "S"), "S", "a:K b:S"),
        (("R", "S"), "RR", "a:R a:R"),
    ],
)
def test_pipeline_sequence_goes_through_its_children(scripts: tuple[str, ...], results: str, expected: str) -> None:
    events: list[str] = []
    assert ticks(of("PipelineSequence", *scripts, events=events), len(results)) == results
    assert " ".join(events) == expected


def test_pipeline_sequence_asks_finished_children_again_and_passes_over_an_earlier_one_that_runs() -> None:
    events: list[str] = []
    conditions = '<ScriptedCond name="q" script="SSRF"/>'
    tree = nav2_tree(f"<PipelineSequence>{conditions}{leaf('R', 'b')}</PipelineSequence>", events)
    assert ticks(tree, 3) == "RRR"
    assert events == ["q:S", "b:R", "q:S", "b:R", "q:R", "b:R"]
    assert ticks(tree, 1) == "F"
    assert events[-2:] == ["q:F", "b:H"]
    assert statuses(tree) == "III"


def test_pipeline_sequence_does_not_run_before_its_children() -> None:
    tree = nav2_tree(f"<Sequence><PipelineSequence>{leaf('K', 'a')}</PipelineSequence>{leaf('R', 'b')}</Sequence>")
    ticks(tree, 1)
    assert statuses(tree) == "RIIR"


@pytest.mark.parametrize(
    ("scripts", "retries", "results", "expected"),
    [
        (("S", "S"), 1, "S", "a:S"),
        (("FS", "S"), 1, "S", "a:F b:S a:S"),
        (("F", "S"), 2, "F", "a:F b:S a:F b:S a:F"),
        (("F", "S"), 0, "F", "a:F"),
        (("F", "F"), 3, "F", "a:F b:F"),
        (("RFRS", "RS"), 1, "RRRS", "a:R a:F b:R b:S a:R a:S"),
        (("K", "S"), 1, "K", "a:K"),
        (("FFFS", "K"), 1, "FFF", "a:F b:K a:F b:K a:F b:K"),
        (("F", "SK"), 2, "FF", "a:F b:S a:F b:K a:F b:S a:F"),
    ],
)
def test_recovery_node_tries_again_after_each_recovery(
    scripts: tuple[str, str], retries: int, results: str, expected: str
) -> None:
    events: list[str] = []
    tree = of("RecoveryNode", *scripts, ports=f'number_of_retries="{retries}"', events=events)
    assert ticks(tree, len(results)) == results
    assert " ".join(events) == expected


def test_recovery_node_that_was_skipped_or_halted_is_idle_and_counts_anew() -> None:
    tree = nav2_tree(
        f"<Sequence><RecoveryNode>{leaf('K', 'a')}{leaf('S', 'b')}</RecoveryNode>{leaf('R', 'c')}</Sequence>"
    )
    ticks(tree, 1)
    assert statuses(tree) == "RIIIR"
    events: list[str] = []
    tree = of("RecoveryNode", "FRFFS", "S", ports='number_of_retries="1"', events=events)
    assert ticks(tree, 1) == "R"
    tree.halt_tree()
    events.clear()
    assert ticks(tree, 1) == "F"
    assert events == ["a:F", "b:S", "a:F"]


@pytest.mark.parametrize("children", [1, 3])
def test_recovery_node_has_exactly_two_children(children: int) -> None:
    with pytest.raises(LoadError, match="RecoveryNode"):
        of("RecoveryNode", *["S"] * children)


@pytest.mark.parametrize(
    ("scripts", "wraps", "results", "expected"),
    [
        (("S", "S", "S"), "true", "SSSS", "a:S b:S c:S a:S"),
        (("F", "RS", "S"), "true", "RSS", "a:F b:R b:S c:S"),
        (("F", "F"), "true", "F", "a:F b:F"),
        (("K", "K"), "true", "K", "a:K b:K"),
        (("K", "F"), "true", "F", "a:K b:F"),
        (("K", "F"), "false", "F", "a:K b:F"),
        (("K", "K"), "false", "K", "a:K b:K"),
        (("S", "S"), "false", "SFS", "a:S b:S a:S"),
        (("F", "S"), "false", "F", "a:F b:S"),
        (("S", "FS", "S"), "false", "SFS", "a:S b:F c:S a:S"),
        (("S",), "true", "SS", "a:S a:S"),
        (("S",), "false", "FF", "a:S a:S"),
    ],
)
def test_round_robin_takes_turns_and_ends_with_the_last_unless_it_wraps_around(
    scripts: tuple[str, ...], wraps: str, results: str, expected: str
) -> None:
    events: list[str] = []
    tree = of("RoundRobin", *scripts, ports=f'wrap_around="{wraps}"', events=events)
    assert ticks(tree, len(results)) == results
    assert " ".join(events) == expected


def test_round_robin_does_not_wrap_around_by_default_and_begins_anew_after_a_halt() -> None:
    events: list[str] = []
    tree = of("RoundRobin", "S", "R", "S", events=events)
    assert ticks(tree, 2) == "SR"
    tree.halt_tree()
    assert ticks(tree, 1) == "S"
    assert events == ["a:S", "b:R", "b:H", "a:S"]


@pytest.mark.parametrize(
    ("scripts", "results", "stored"),
    [
        (("RS", "S"), "RS", "III"),
        (("R", "RF"), "RF", "III"),
        (("S", "R"), "R", "RSR"),
        (("F", "R"), "F", "III"),
    ],
)
def test_nonblocking_sequence_ticks_all_children(scripts: tuple[str, ...], results: str, stored: str) -> None:
    tree = of("NonblockingSequence", *scripts)
    assert ticks(tree, len(results)) == results
    assert statuses(tree) == stored


def test_nonblocking_sequence_does_not_allow_a_skipped_child() -> None:
    with pytest.raises(NodeError, match="its child 'b' was skipped, which NonblockingSequence does not allow"):
        of("NonblockingSequence", "R", "K").tick_once()


@pytest.mark.parametrize(
    ("scripts", "results", "place"),
    [
        (("S", "RS", "S"), "R", 1),
        (("S", "K", "R"), "R", 2),
        (("S", "F"), "F", 0),
        (("S", "K"), "S", 0),
        (("K",), "S", 0),
    ],
)
def test_persistent_sequence_keeps_its_place_on_the_board(scripts: tuple[str, ...], results: str, place: int) -> None:
    tree = of("PersistentSequence", *scripts, ports='current_child_idx="{place}"')
    tree.blackboard.set("place", 0)
    assert ticks(tree, len(results)) == results
    assert tree.blackboard.get("place") == place


def test_persistent_sequence_goes_on_after_a_halt_and_where_it_is_put() -> None:
    events: list[str] = []
    tree = of("PersistentSequence", "S", "R", "S", ports='current_child_idx="{place}"', events=events)
    ticks(tree, 1)
    tree.halt_tree()
    ticks(tree, 1)
    assert events == ["a:S", "b:R", "b:H", "b:R"]
    tree.blackboard.set("place", 2)
    assert ticks(tree, 1) == "S"
    tree.blackboard.set("place", -1)
    with pytest.raises(NodeError, match="children are counted from 0"):
        tree.tick_once()
    with pytest.raises(LoadError, match="needs a blackboard key"):
        of("PersistentSequence", "S", ports='current_child_idx="0"')


def paused(*scripts: str, events: list[str] | None = None) -> tuple[Tree, PauseResumeController]:
    tree = of("PauseResumeController", *scripts, events=events)
    assert isinstance(tree.root, PauseResumeController)
    return tree, tree.root


def test_pause_resume_controller_goes_through_its_four_children() -> None:
    events: list[str] = []
    tree, controller = paused("RRRS", "R", "RS", "S", events=events)
    assert not controller.request_resume()
    assert ticks(tree, 1) == "R"
    assert controller.request_pause()
    assert ticks(tree, 3) == "RRR"
    assert controller.is_paused
    assert not controller.request_pause()
    assert controller.request_resume()
    assert ticks(tree, 3) == "RRR"
    assert ticks(tree, 1) == "S"
    assert " ".join(events) == "a:R a:H c:R c:S b:R b:H d:S a:R a:R a:S"


def test_pause_resume_controller_waits_where_children_are_missing() -> None:
    tree, controller = paused("R")
    ticks(tree, 1)
    controller.request_pause()
    assert ticks(tree, 4) == "RRRR"
    assert statuses(tree) == "RI"
    controller.request_resume()
    ticks(tree, 2)
    assert statuses(tree) == "RR"


@pytest.mark.parametrize(("script", "result"), [("S", "S"), ("K", "S"), ("F", "F"), ("R", "R")])
def test_pause_resume_controller_ends_with_its_first_child(script: str, result: str) -> None:
    tree, _ = paused(script, "S")
    assert ticks(tree, 1) == result


def test_pause_resume_controller_fails_with_any_child_and_a_halt_resumes_it() -> None:
    tree, controller = paused("R", "F")
    ticks(tree, 1)
    controller.request_pause()
    assert ticks(tree, 2) == "RF"
    tree, controller = paused("R")
    ticks(tree, 1)
    controller.request_pause()
    ticks(tree, 2)
    assert controller.is_paused
    tree.halt_tree()
    assert not controller.is_paused


def test_pause_resume_controller_offers_its_services() -> None:
    services: dict[str, Callable[[], bool]] = {}
    registry = scripted_registry([])
    register_nav2(registry, offer_service=services.__setitem__)
    ports = 'pause_service_name="/pause" resume_service_name="/resume"'
    tree = load_text(document(f"<PauseResumeController {ports}>{leaf('R')}</PauseResumeController>"), registry)
    tree.tick_once()
    assert [services["/resume"](), services["/pause"]()] == [False, True]
    assert tree.next_wake_up() is not None


def test_missions_know_nav2s_nodes() -> None:
    registry = node_types(cast("LeafContext", None))
    assert {node_class.__name__ for node_class in NAV2_NODES} <= set(registry.manifests)


def test_names_that_are_taken_are_left_out() -> None:
    registry = Registry()
    registry.register(NAV2_NODES[0], "RoundRobin")
    assert register_nav2(registry) == ("RoundRobin",)
    assert len(register_nav2(registry)) == len(NAV2_NODES)
