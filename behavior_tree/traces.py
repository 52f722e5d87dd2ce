"""Traces: what a tree did, tick by tick, and whether our tree does the same.

A record has the XML of a tree of scripted leaves and how it was ticked. ``exact`` is once a line; ``once`` is until no
node asked for another tick. Then come the number of the tick in whose place the tree was halted (-1: none), and a line
for each tick. A line has the result's letter or ``error`` and the stored statuses' letters in order of creation. The
events of the leaves and the values of the top blackboard follow. An error ends the trace; its line may be the word
alone, and then states no more. A trace without lines is that of a tree that was refused when it was loaded.
"""

import json
import math
from collections.abc import Callable, MutableSequence
from dataclasses import dataclass
from typing import Any, Final

from .clock import ManualClock
from .errors import TreeError
from .load import load_text
from .node_registry import Registry
from .scripted import LETTERS, scripted_registry
from .tree import Tree

ERROR: Final = "error"
CRASH: Final = "crash"
MODES: Final = ("exact", "once")
MAX_TICKS: Final = 10_000
"""Root ticks in one line; a tree that wants more will never have enough."""


class BadRecord(Exception):
    """A line is no trace; the text states why."""


@dataclass(frozen=True, slots=True)
class Line:
    """The observable state after one tick: see the module."""

    root: str
    statuses: str = ""
    events: tuple[str, ...] = ()
    board: tuple[tuple[str, Any], ...] = ()


@dataclass(frozen=True, slots=True)
class Record:
    """A trace: see the module."""

    xml: str
    mode: str
    halt_at: int
    trace: tuple[Line, ...]


@dataclass(frozen=True, slots=True)
class Mismatch:
    """The first difference between a trace and what our tree did.

    Attributes:
        tick: The number of the line, from 1; 0 where the tree could not be loaded.
        what: The subject of the difference.
        expected: The value in the trace.
        got: The value of our tree.
    """

    tick: int
    what: str
    expected: str
    got: str

    def __str__(self) -> str:
        """Return one line of text."""
        return f"tick {self.tick}: {self.what}: expected {self.expected}, got {self.got}"


def parse_record(text: str) -> Record:
    """Make a record from a line of JSON.

    Raises:
        BadRecord: It is no JSON, or not what a record looks like.
    """
    try:
        given = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadRecord(f"no JSON: {error}") from None
    if not isinstance(given, dict):
        raise BadRecord(f"a record is an object, not {type(given).__name__}")
    for name, kind in (("xml", str), ("mode", str), ("halt_at", int), ("trace", list)):
        if name not in given:
            raise BadRecord(f"the field '{name}' is missing")
        if not isinstance(given[name], kind) or isinstance(given[name], bool):
            raise BadRecord(f"the field '{name}' must be {kind.__name__}, not {type(given[name]).__name__}")
    if given["mode"] not in MODES:
        raise BadRecord(f"the mode '{given['mode']}' is none of {', '.join(MODES)}")
    lines = tuple(_line(number, item) for number, item in enumerate(given["trace"], start=1))
    return Record(given["xml"], given["mode"], given["halt_at"], lines)


def first_mismatch(
    record: Record, registry: Callable[[MutableSequence[str]], Registry] = scripted_registry
) -> Mismatch | None:
    """Run a record's tree and return the first difference, None if there is none.

    Nothing that the tree does raises here; only the engine's own errors are what a trace calls an error, anything else
    differs. The tree is halted as BehaviorTree.CPP does it, see `Tree.halt_tree`.

    Args:
        record: The trace.
        registry: Makes the node types, whose leaves log their events into the list that it is given.
    """
    events: list[str] = []
    try:
        tree = load_text(record.xml, registry(events), clock=ManualClock(), strict=True)
    except Exception as error:
        if _is_ours(error) and (not record.trace or record.trace[0].root == ERROR):
            return None
        return Mismatch(0, "loading", "a tree" if record.trace else "a refusal", _shown(error))
    if not record.trace:
        return Mismatch(0, "loading", "a refusal", "a tree")
    for number, expected in enumerate(record.trace, start=1):
        events.clear()
        got, reason = _step(tree, record, number, events)
        if expected == Line(ERROR) and got.root == ERROR:
            return None  # The record states that there was an error, and no more.
        mismatch = _difference(number, expected, got, reason)
        if mismatch is not None or got.root == ERROR:
            return mismatch
    return None


def _step(tree: Tree, record: Record, number: int, events: list[str]) -> tuple[Line, str]:
    """Do what a line states; return what is to be seen then and, after an error, its text."""
    root, reason = ERROR, ""
    try:
        if number == record.halt_at:
            tree.halt_tree(like_btcpp=True)
            root = LETTERS[0]
        elif record.mode == "exact":
            root = LETTERS[tree.tick_exactly_once()]
        else:
            root = LETTERS[tree.tick_once(MAX_TICKS)]
    except Exception as error:
        root = ERROR if _is_ours(error) else CRASH
        reason = _shown(error)
    statuses = "".join(LETTERS[node.status] for node in tree.nodes)
    board = tuple(sorted(tree.blackboard.dump().items()))
    return Line(root, statuses, tuple(events), board), reason


def _is_ours(error: Exception) -> bool:
    """Distinguish the engine's own errors from its bugs, which a node's error may be wrapped around."""
    cause = error.__cause__
    return isinstance(error, TreeError) and isinstance(cause, TreeError | ValueError | None)


def _difference(number: int, expected: Line, got: Line, reason: str) -> Mismatch | None:
    if got.root != expected.root:
        return Mismatch(number, "result", expected.root, f"{got.root}: {reason}" if reason else got.root)
    if got.statuses != expected.statuses:
        return Mismatch(number, "stored statuses", expected.statuses, got.statuses)
    if got.events != expected.events:
        return Mismatch(number, "events", str(list(expected.events)), str(list(got.events)))
    if [_typed(*entry) for entry in got.board] != [_typed(*entry) for entry in expected.board]:
        return Mismatch(number, "blackboard", _json(expected.board), _json(got.board))
    return None


def _typed(key: str, value: Any) -> tuple[str, str, str]:
    """Make values of different types differ: 1 is a whole number, 1.0 a real. Reals are compared in full."""
    if isinstance(value, float) and not math.isfinite(value):
        value = None  # JSON has no such number; where C++ writes it, there is null.
    return key, type(value).__name__, repr(value)


def _json(board: tuple[tuple[str, Any], ...]) -> str:
    return json.dumps(dict(board), default=repr, ensure_ascii=False)


def _shown(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


def _line(number: int, item: Any) -> Line:
    place = f"line {number} of the trace"
    if not isinstance(item, list) or not item or not isinstance(item[0], str):
        raise BadRecord(f"{place} must be a list that begins with a letter or '{ERROR}'")
    if item == [ERROR]:
        return Line(ERROR)
    if len(item) != 4:
        raise BadRecord(f"{place} must have the result, the statuses, the events and the blackboard; has {len(item)}")
    root, statuses, events, board = item
    if root != ERROR and (root not in LETTERS or len(root) != 1):
        raise BadRecord(f"{place}: '{root}' is none of the letters {', '.join(LETTERS)}")
    if not isinstance(statuses, str) or not isinstance(events, list) or not isinstance(board, dict):
        raise BadRecord(f"{place}: the statuses must be text, the events a list, the blackboard an object")
    return Line(root, statuses, tuple(str(event) for event in events), tuple(sorted(board.items())))
