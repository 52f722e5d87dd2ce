"""Substitution: which node is replaced by what, from Python and from JSON."""

import json
from typing import Any

import pytest

from behavior_tree import (
    FAILURE,
    RUNNING,
    SKIPPED,
    SUCCESS,
    LoadError,
    ManualClock,
    MockConfig,
    NodeError,
    Registry,
    RegistryError,
    Tree,
    load_text,
)
from behavior_tree.scripted import scripted_registry
from tests.behavior_tree.trees import document, leaf, ticks

BODY = f"<Sequence name='main'>{leaf('R', 'first')}<SubTree ID='T' name='sub'/>{leaf('R', 'last')}</Sequence>"
SUB = f"<BehaviorTree ID='T'><Fallback name='inner'>{leaf('R', 'deep')}{leaf('R', 'deeper')}</Fallback></BehaviorTree>"


def tree_with(*rules: tuple[str, Any], body: str = BODY, clock: ManualClock | None = None) -> Tree:
    registry = scripted_registry([])
    for pattern, substitution in rules:
        registry.substitute(pattern, substitution)
    return load_text(document(body, SUB), registry, clock=clock or ManualClock())


def kinds(tree: Tree) -> dict[str, str]:
    return {node.path: type(node).__name__ for node in tree.nodes}


def test_rule_names_an_instance_a_type_or_a_path() -> None:
    assert kinds(tree_with(("first", "AlwaysSuccess")))["first"] == "AlwaysSuccess"
    by_type = kinds(tree_with(("Scripted", "AlwaysFailure")))
    assert [path for path, kind in by_type.items() if kind == "AlwaysFailure"] == [
        "first", "sub/deep", "sub/deeper", "last"]  # fmt: skip
    by_path = kinds(tree_with(("sub/d*p?r", "AlwaysFailure")))
    assert [path for path, kind in by_path.items() if kind == "AlwaysFailure"] == ["sub/deeper"]
    assert "AlwaysFailure" not in kinds(tree_with(("sub/dee[p]", "AlwaysFailure"))).values()


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
def test_name_goes_before_type_and_type_before_path_in_any_order_of_rules(order: tuple[int, ...]) -> None:
    rules = (("deep", "AlwaysSuccess"), ("Scripted", "AlwaysFailure"), ("*", "Sleep"))
    tree = tree_with(
        *(rules[number] for number in order), ("main", "Sequence"), ("inner", "Fallback"), ("sub", "SubTree")
    )
    found = kinds(tree)
    assert (found["sub/deep"], found["sub/deeper"]) == ("AlwaysSuccess", "AlwaysFailure")


def test_first_of_several_rules_that_fit_alike_counts() -> None:
    assert kinds(tree_with(("first", "AlwaysSuccess"), ("first", "AlwaysFailure")))["first"] == "AlwaysSuccess"


def test_sub_tree_and_everything_below_may_be_replaced() -> None:
    for pattern in ("sub", "T", "SubTree"):
        tree = tree_with((pattern, MockConfig(FAILURE)))
        assert [node.path for node in tree.nodes] == ["main", "first", "sub", "last"]
    tree = tree_with(("sub", MockConfig(FAILURE)), ("first", "AlwaysSuccess"))
    assert ticks(tree, 1) == "F"


def test_control_node_may_become_another_one_or_a_leaf() -> None:
    assert kinds(tree_with(("inner", "ReactiveFallback")))["sub/inner"] == "ReactiveFallback"
    assert kinds(tree_with(("inner", MockConfig()))) == {
        "main": "Sequence", "first": "Scripted", "sub": "SubTree", "sub/inner": "MockAction", "last": "Scripted",
    }  # fmt: skip


def test_substitute_keeps_the_conditions_and_the_ports_that_it_knows() -> None:
    sleep = "<Sleep name='s' msec='500' _skipIf='skip'/>"
    body = f"<Sequence>{sleep}<Script code='x := 1' name='t' _post='y := 2'/></Sequence>"
    clock = ManualClock()
    tree = tree_with(("t", "ScriptCondition"), ("s", "Sleep"), body=body, clock=clock)
    tree.blackboard.set("skip", 1)
    assert ticks(tree, 1) == "S"
    assert tree.blackboard.dump() == {"skip": 1, "x": 1, "y": 2}


@pytest.mark.parametrize(
    ("pattern", "substitution", "message"),
    [
        ("first", "Nobody", "there is no node type 'Nobody' to take the place of 'first'"),
        ("first", "Inverter", "Inverter needs exactly 1 child, it has 0"),
        ("first", "SubTree", "a sub-tree cannot take another node's place"),
        ("inner", "Inverter", "it has 2"),
        ("first", "Script", "input 'code' is not given"),
        ("first", MockConfig(post_script="1 +"), "expected a value"),
    ],
)
def test_impossible_substitution_is_a_load_error_at_the_node(pattern: str, substitution: Any, message: str) -> None:
    with pytest.raises(LoadError, match=message) as caught:
        tree_with((pattern, substitution))
    assert caught.value.line == 1
    assert caught.value.node


@pytest.mark.parametrize(("status", "letter"), [(SUCCESS, "S"), (FAILURE, "F"), (SKIPPED, "K"), (RUNNING, "R")])
def test_mock_returns_the_status_it_is_given(status: Any, letter: str) -> None:
    assert ticks(tree_with(("first", MockConfig(status)), body=leaf("R", "first")), 1) == letter


def test_mock_runs_for_its_delay_and_then_the_scripts_of_its_result() -> None:
    clock = ManualClock()
    config = MockConfig(async_delay=200, success_script="l += 's'", failure_script="l += 'f'", post_script="l += 'p'")
    tree = tree_with(("first", config), body=leaf("R", "first"), clock=clock)
    tree.blackboard.set("l", "")
    assert ticks(tree, 1) == "R"
    assert tree.next_wake_up() == 0.2
    clock.advance(0.1)
    assert ticks(tree, 1) == "R"
    tree.halt_tree()
    assert tree.next_wake_up() is None
    assert tree.blackboard.get("l") == ""
    ticks(tree, 1)
    clock.advance(0.2)
    assert ticks(tree, 1) == "S"
    assert tree.blackboard.get("l") == "sp"


def test_last_script_runs_whatever_the_result_and_the_others_only_with_theirs() -> None:
    for status, log in ((FAILURE, "fp"), (SKIPPED, "p"), (RUNNING, "p")):
        config = MockConfig(status, success_script="l += 's'", failure_script="l += 'f'", post_script="l += 'p'")
        tree = tree_with(("first", config), body=leaf("R", "first"))
        tree.blackboard.set("l", "")
        tree.tick_once()
        assert tree.blackboard.get("l") == log


def test_result_may_come_from_a_script_that_names_statuses() -> None:
    config = MockConfig(FAILURE, return_status_script="n > 2 ? SUCCESS : (n > 1 ? 'SKIPPED' : FAILURE)")
    tree = tree_with(("first", config), body=leaf("R", "first"))
    results = ""
    for number in (1, 2, 3):
        tree.blackboard.set("n", number)
        results += ticks(tree, 1)
    assert results == "FKS"
    tree = tree_with(("first", MockConfig(return_status_script="'DONE'")), body=leaf("R", "first"))
    with pytest.raises(NodeError, match="'DONE' is not a status"):
        tree.tick_once()


RULES = {
    "TestNodeConfigs": {
        "slow": {"return_status": "FAILURE", "async_delay": 100, "post_script": "x := 1"},
        "by_script": {"return_status_script": "SUCCESS"},
    },
    "SubstitutionRules": {"first": "by_script", "sub": "slow", "last": "AlwaysSuccess"},
}


def test_rules_are_read_from_json() -> None:
    registry = scripted_registry([])
    registry.substitutions.add_json(json.dumps(RULES))
    assert len(registry.substitutions) == 3
    clock = ManualClock()
    tree = load_text(document(BODY, SUB), registry, clock=clock)
    assert ticks(tree, 1) == "R"
    clock.advance(0.1)
    assert ticks(tree, 1) == "F"
    assert tree.blackboard.get("x") == 1


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("nonsense", "substitution rules: Expecting value"),
        ("[]", "must be an object"),
        ('{"TestNodeConfigs": []}', "TestNodeConfigs must be an object"),
        ('{"TestNodeConfigs": {"a": 1}}', "'a' must be an object"),
        ('{"TestNodeConfigs": {"a": {}}}', "'a' needs return_status or return_status_script"),
        ('{"TestNodeConfigs": {"a": {"return_status": "DONE"}}}', "'DONE' is not a status"),
        ('{"TestNodeConfigs": {"a": {"return_status": "IDLE"}}}', "return_status is IDLE"),
        ('{"TestNodeConfigs": {"a": {"return_status": 2}}}', "return_status must be text"),
        ('{"TestNodeConfigs": {"a": {"return_status": "SUCCESS", "delay": 2}}}', "'a' has 'delay'; there are"),
        ('{"TestNodeConfigs": {"a": {"return_status": "SUCCESS", "async_delay": "2"}}}', "whole number"),
        ('{"TestNodeConfigs": {"a": {"return_status": "SUCCESS", "async_delay": -2}}}', "must not be negative"),
        ('{"SubstitutionRules": {"a": 1}}', "'a' must name a config or a node type"),
        ("[" * 100_000, "substitution rules"),
    ],
)
def test_faulty_json_is_refused_with_the_reason(given: str, message: str) -> None:
    registry = Registry()
    with pytest.raises(RegistryError, match=message):
        registry.substitutions.add_json(given)
    assert len(registry.substitutions) == 0


def test_copy_of_a_registry_goes_its_own_way() -> None:
    registry = Registry()
    copy = registry.copy()
    copy.substitute("*", MockConfig())
    copy.enums["RED"] = 1
    assert (len(registry.substitutions), registry.enums) == (0, {})
    assert load_text(document("<AlwaysFailure/>"), copy).tick_once() == SUCCESS
    assert load_text(document("<AlwaysFailure/>"), registry).tick_once() == FAILURE
