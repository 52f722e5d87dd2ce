"""Records the changes of nodes' statuses to a file, and reads it again.

A recording is a file of JSON lines. A line with ``tree`` begins a tree: its nodes with their statuses. A line with
``changes`` has those of one tick, each as uid, status before, status after and time in seconds. Where some are missed,
``statuses`` has those of all nodes behind the tick.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from regraft.bus_schema.messages.mission import MissionNode, MissionTransition, MissionTransitions, NodeStatus

MAX_SIZE: Final = 200_000_000
"""Characters of a recording; it ends there."""
MAX_LINE: Final = 20_000_000
"""Bytes of one line: a tree of 10,000 nodes, or 5,000 changes, has less."""
VERSION: Final = 1


class Unreadable(Exception):
    """A file is no recording, or cannot be read; the text names file and line."""


@dataclass(frozen=True, slots=True)
class Step:
    """One tick of a recording: the tree, its nodes after the tick, and the changes that led there.

    ``missed`` counts changes that were too many to be recorded. A step that begins a tree has no changes, and tick 0.
    """

    tree: str
    tick: int
    stamp: float
    nodes: tuple[MissionNode, ...]
    changes: tuple[MissionTransition, ...] = ()
    missed: int = 0


class Recording:
    """A file that changes are written to; it ends when it is full, or cannot be written."""

    def __init__(self, path: Path, report: Callable[[str], object]) -> None:
        """Begin a new file with the first changes; ``report`` is called with why the recording ends, if it does."""
        self._path = path
        self._report = report
        self._structure = ""
        self._size = 0
        self._ended = False

    def write(self, tree: str, nodes: tuple[MissionNode, ...], batch: MissionTransitions) -> None:
        """Write the changes of one tick; ``nodes`` have their statuses after it."""
        if self._ended:
            return
        lines = [_batch_line(nodes, batch)]
        if batch.structure != self._structure:
            lines.insert(0, _tree_line(tree, nodes, batch))
        text = "".join(json.dumps(line, separators=(",", ":")) + "\n" for line in lines)
        if self._size + len(text) > MAX_SIZE:
            self._end(f"'{self._path}' is full: must have at most {MAX_SIZE} characters")
            return
        try:
            if not self._size and not may_be_replaced(self._path):
                self._end(f"'{self._path}' is there, and no recording: give the name of a new file")
                return
            # Opened for each tick: the executor's process may end at any time.
            with self._path.open("a" if self._size else "w", encoding="utf-8") as file:
                file.write(text)
        except (OSError, ValueError) as error:
            self._end(f"{str(self._path)!r} cannot be written: {getattr(error, 'strerror', None) or error}")
        self._structure = batch.structure
        self._size += len(text)

    def _end(self, why: str) -> None:
        self._ended = True
        self._report(f"the recording ends: {why}")


def may_be_replaced(path: Path) -> bool:
    """Return whether a path is free, empty, or has an earlier recording: no other file is ever overwritten.

    Raises OSError or ValueError for a path that no file can have.
    """
    if not path.exists():
        return True
    try:
        return path.is_file() and (path.stat().st_size == 0 or next(steps(path), None) is not None)
    except (OSError, Unreadable):
        return False


def _tree_line(tree: str, nodes: tuple[MissionNode, ...], batch: MissionTransitions) -> dict[str, Any]:
    statuses = {node.uid: node.status for node in nodes}
    for change in reversed(batch.changes):
        statuses[change.uid] = change.before
    rows = [[node.uid, node.parent, node.name, node.type, node.path, statuses[node.uid].value] for node in nodes]
    return {"version": VERSION, "tree": tree, "stamp": batch.stamp, "nodes": rows}


def _batch_line(nodes: tuple[MissionNode, ...], batch: MissionTransitions) -> dict[str, Any]:
    rows = [[change.uid, change.before.value, change.after.value, change.stamp] for change in batch.changes]
    line: dict[str, Any] = {"tick": batch.tick, "stamp": batch.stamp, "missed": batch.missed, "changes": rows}
    return line | {"statuses": [node.status.value for node in nodes]} if batch.missed else line


def steps(path: Path) -> Iterator[Step]:
    """Yield the steps of a recording in their order.

    Raises:
        Unreadable: the file cannot be read, or is no recording. A last line that is cut off is left out.
    """
    present: Step | None = None
    for number, text, is_whole in _lines(path):
        place = f"{path}:{number}"
        try:
            line = json.loads(text)
            present = _begun(line) if "tree" in line else _followed(present, line)
        except (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError) as error:
            if not is_whole and present is not None:
                return
            wanted = "must be a tree or the changes of a tick, as a recording has them"
            raise Unreadable(f"{place}: {wanted}: {type(error).__name__}: {error}") from None
        yield present
    if present is None:
        raise Unreadable(f"{path}: is empty: must be a recording of a mission")


def _lines(path: Path) -> Iterator[tuple[int, str, bool]]:
    """Yield each line with its number, and whether it is whole."""
    number = 0
    try:
        with path.open("rb") as file:
            while data := file.readline(MAX_LINE + 1):
                number += 1
                if len(data) > MAX_LINE:
                    raise Unreadable(f"{path}:{number}: is too long: must have at most {MAX_LINE} bytes")
                yield number, data.decode("utf-8", "replace"), data.endswith(b"\n")
    except OSError as error:
        raise Unreadable(f"{path}: cannot be read: {error.strerror}") from None


def _begun(line: dict[str, Any]) -> Step:
    if line["version"] != VERSION:
        raise ValueError(f"version is {line['version']!r}, must be {VERSION}")
    nodes: list[MissionNode] = []
    for uid, parent, name, kind, path, status in line["nodes"]:
        if uid != len(nodes) + 1 or not 0 <= parent < uid:
            raise ValueError(f"node {uid} of parent {parent} is at place {len(nodes) + 1}")
        nodes.append(MissionNode(uid, parent, str(name), str(kind), str(path), NodeStatus(status)))
    return Step(str(line["tree"]), 0, float(line["stamp"]), tuple(nodes))


def _followed(before: Step | None, line: dict[str, Any]) -> Step:
    if before is None:
        raise ValueError("changes come before a tree")
    nodes = list(before.nodes)
    changes = []
    for uid, previous, after, stamp in line["changes"]:
        if not 1 <= uid <= len(nodes):
            raise ValueError(f"there is no node {uid}, only {len(nodes)}")
        changes.append(MissionTransition(uid, NodeStatus(previous), NodeStatus(after), float(stamp)))
        nodes[uid - 1] = replace(nodes[uid - 1], status=NodeStatus(after))
    if "statuses" in line:
        statuses = map(NodeStatus, line["statuses"])
        nodes = [replace(node, status=status) for node, status in zip(nodes, statuses, strict=True)]
    tick, stamp, missed = int(line["tick"]), float(line["stamp"]), int(line["missed"])
    return Step(before.tree, tick, stamp, tuple(nodes), tuple(changes), missed)
