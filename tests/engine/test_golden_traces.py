"""Replays what BehaviorTree.CPP 4.10 did on random trees and compares all that was recorded of it."""

import gzip
import json
from pathlib import Path
from typing import Any

import pytest

from services.bt_executor.engine import NodeError, Tree, load_text

from .scripted_nodes import LETTERS, scripted_registry

TRACES = Path(__file__).with_name("btcpp_traces.jsonl.gz")


def recorded() -> list[dict[str, Any]]:
    with gzip.open(TRACES, "rt", encoding="utf-8") as lines:
        return [json.loads(line) for line in lines]


def typed(board: dict[str, Any]) -> dict[str, tuple[str, Any]]:
    """Make values of different types unequal: 1 is an int64 in C++, 1.0 a double."""
    return {key: (type(value).__name__, value) for key, value in board.items()}


def step(tree: Tree, record: dict[str, Any], number: int) -> str:
    if number == record["halt_at"]:
        tree.halt_tree()
        return "I"
    try:
        status = tree.tick_exactly_once() if record["mode"] == "exact" else tree.tick_once()
    except NodeError:
        return "error"
    return LETTERS[status]


def replay(record: dict[str, Any]) -> None:
    events: list[str] = []
    tree = load_text(record["xml"], scripted_registry(events))
    for number, (root, statuses, expected_events, board) in enumerate(record["trace"], start=1):
        events.clear()
        assert step(tree, record, number) == root, f"root at tick {number}"
        if root == "error":
            return
        assert "".join(LETTERS[node.status] for node in tree.nodes) == statuses, f"statuses at tick {number}"
        assert events == expected_events, f"events at tick {number}"
        assert typed(tree.blackboard.dump()) == typed(board), f"blackboard at tick {number}"


@pytest.mark.parametrize("part", range(10))
def test_recorded_trees_tick_as_in_behaviortree_cpp(part: int) -> None:
    records = recorded()
    assert len(records) == 1500
    for record in records[part::10]:
        try:
            replay(record)
        except AssertionError as error:
            raise AssertionError(f"{error}\nin {record['xml']}") from error
