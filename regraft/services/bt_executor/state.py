"""The state of an executor that outlives its process: its tree's source, and the plain part of its blackboard."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from behavior_tree import BlackboardError, Tree
from regraft.bus_schema.annotations import PlainValue
from regraft.services.bt_executor.report import kept_blackboard
from regraft.services.bt_executor.source import Source


def kept_state(source: Source, runs: bool, tree: Tree | None, reflected: PlainValue) -> dict[str, PlainValue]:
    """Return the state of an executor; ``runs`` is whether its mission runs, or is to run again."""
    return {
        "runs": runs,
        "file": source.file,
        "text": source.text,
        "main": source.main,
        "folder": source.folder,
        "blackboard": kept_blackboard(tree.blackboard) if tree else {},
        "reflected": reflected,
    }


def kept_source(state: PlainValue) -> Source:
    """Return where the tree of a state came from."""
    return Source(state["file"], state["text"], state["main"], state["folder"])


def restore_board(tree: Tree, state: PlainValue, warn: Callable[..., Any]) -> None:
    """Write the entries of a state to a tree's root blackboard; those that do not fit are reported."""
    for key, value in state["blackboard"].items():
        try:
            tree.blackboard.set(key, value)
        except BlackboardError as error:
            warn("blackboard entry not restored: %s", error)
