"""Reads and writes a mission's blackboards from outside, and carries one over to the next tree."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass, replace
from typing import Any, Final, get_args, get_origin

from behavior_tree import Blackboard, BlackboardError, Entry, Tree
from behavior_tree.data.values import to_type, type_name
from regraft import RefusalCode, RequestRefused
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.messages.mission import BlackboardEntries, BlackboardEntry
from regraft.bus_schema.suggestions import instead_of
from regraft.services.bt_executor.plain_values import MAX_TEXT_LENGTH, is_plain, shown

MAX_AT_ONCE: Final = 100
MAX_KEY_LENGTH: Final = 200
KEY: Final = re.compile(r"(?![\s@])[^{}\x00-\x1f\x7f]+(?<!\s)")
"""The entries that ``{key}`` in a tree can name."""


class BoardRefusal(RequestRefused):
    """An entry or board that is not there, or a value that does not fit; the text states what would be right."""

    def __init__(self, why: str, code: RefusalCode = RefusalCode.INVALID) -> None:
        super().__init__(why, code)


def board_of(tree: Tree, path: str) -> Blackboard:
    """Return the board of the sub-tree with a path, the root's for an empty one; raises BoardRefusal.

    The tree's ID is the root's too, unless a sub-tree has it as its path.
    """
    if not path:
        return tree.blackboard
    if path in tree.blackboards:
        return tree.blackboards[path]
    why = f"there is no sub-tree {path!r} with a blackboard; {instead_of(path, other_boards(tree))}"
    raise BoardRefusal(why, RefusalCode.NOT_FOUND)


def other_boards(tree: Tree) -> tuple[str, ...]:
    """Return the paths of the sub-trees, each of which has a board."""
    return tuple(path for path, board in tree.blackboards.items() if board is not tree.blackboard)


def read_board(tree: Tree, path: str, key: str, now: float) -> BlackboardEntries:
    """Return one entry, or all of a board for an empty key; raises BoardRefusal."""
    board = board_of(tree, path)
    keys = [key] if key else board.keys()
    return BlackboardEntries(now, path, tuple(_told(board, name, now) for name in keys), other_boards(tree))


def _told(board: Blackboard, key: str, now: float) -> BlackboardEntry:
    entry = board.find(key)
    if entry is None:
        why = f"there is no blackboard entry {key!r}; {instead_of(key, board.keys())}"
        raise BoardRefusal(why, RefusalCode.NOT_FOUND)
    age = max(0.0, now - entry.stamp) if entry.sequence else None
    return BlackboardEntry(key, shown(entry.value), type_name(_type_of(entry)), entry.sequence, age)


def _type_of(entry: Entry) -> Any:
    """Return an entry's type; that of its value if no node has given it one, as where a script created it."""
    return type(entry.value) if entry.type is None and entry.value is not None else entry.type


def write_board(tree: Tree, path: str, values: Mapping[str, PlainValue], now: float) -> BlackboardEntries:
    """Write entries of a board, all or none; None removes an entry. Returns those written as they are now.

    The engine's rules hold. Text is converted to the entry's type, a number to another kind of number where that loses
    nothing. Misfits are refused. An entry of a message type takes the message as a map.

    Raises:
        BoardRefusal: a key or value is none, or does not fit; nothing has been written.
    """
    board = board_of(tree, path)
    if not values:
        raise BoardRefusal("there is nothing to write: give at least one entry")
    if len(values) > MAX_AT_ONCE:
        raise BoardRefusal(f"{len(values)} entries are too many at once: write at most {MAX_AT_ONCE}")
    for key, value in values.items():
        _check(key, value)
    before = {key: _copy(board.find(key)) for key in values}
    try:
        for key, value in values.items():
            if value is not None:
                _write(board, key, value)
    except BoardRefusal:
        for key, entry in before.items():
            _put_back(board, key, entry)
        raise
    for key, value in values.items():
        if value is None:
            board.unset(key)
    told = tuple(_told(board, key, now) for key in values if board.find(key))
    return BlackboardEntries(now, path, told, other_boards(tree))


def _check(key: str, value: PlainValue) -> None:
    if len(key) > MAX_KEY_LENGTH or not KEY.fullmatch(key):
        what = "a name as in {key}, without braces, @, and blanks around it"
        raise BoardRefusal(f"{key[:MAX_KEY_LENGTH]!r} is no key of a blackboard entry: must be {what}")
    if not is_plain(value):
        most = f"numbers of 64 bits, text of at most {MAX_TEXT_LENGTH} characters, lists and maps of them"
        raise BoardRefusal(f"blackboard entry {key!r} cannot be written with this value: must be {most}")


def _write(board: Blackboard, key: str, value: PlainValue) -> None:
    board.fix_type(key)
    entry = board.find(key)
    try:
        board.set(key, _converted(value, entry.type, board) if entry else value)
    except BlackboardError as error:
        raise BoardRefusal(error.message) from None
    except (SchemaError, ValueError) as error:
        raise BoardRefusal(f"blackboard entry '{key}': {error}") from None


def _copy(entry: Entry | None) -> Entry | None:
    return replace(entry) if entry else None


def _put_back(board: Blackboard, key: str, before: Entry | None) -> None:
    """Undo a write, so that nobody sees that there was one."""
    entry = board.find(key)
    if before is None:
        board.unset(key)
    elif entry is not None:
        entry.value, entry.type, entry.sequence, entry.stamp = before.value, before.type, before.sequence, before.stamp


def _converted(value: PlainValue, kind: Any, board: Blackboard) -> Any:
    """Return messages made from maps, and lists with items of the right type; all else as it is."""
    if isinstance(value, dict) and isinstance(kind, type) and is_dataclass(kind):
        return codec.from_plain(value, kind)
    if isinstance(value, list) and get_origin(kind) is list:
        return [to_type(item, get_args(kind)[0], board.converters) for item in value]
    return value


@dataclass(frozen=True, slots=True)
class Carried:
    """Which entries were carried over, and why others were not."""

    keys: tuple[str, ...]
    clashes: dict[str, str]


def carry_over(old: Blackboard, new: Blackboard) -> Carried:
    """Give a new tree's root board the entries of the old one's that have a value, with their stamps.

    An entry that the new tree has given a type keeps that type: the value is converted as the engine's rules are,
    and left out where it does not fit.
    """
    keys = []
    clashes = {}
    for key in old.keys():  # noqa: SIM118 - a blackboard is no mapping
        was = old.find(key)
        if was is None or was.value is None:
            continue
        try:
            known = new.find(key)
            if known is None:
                new.declare(key, was.type)
            elif known.type is None:
                known.type = was.type
            new.set(key, was.value)
        except BlackboardError as error:
            clashes[key] = error.message
            continue
        entry = new.find(key)
        assert entry is not None
        entry.sequence, entry.stamp = was.sequence, was.stamp
        keys.append(key)
    return Carried(tuple(keys), clashes)


def summary(values: Mapping[str, PlainValue], longest: int = 200) -> str:
    """Return what was written as a line of text."""
    told = ", ".join(f"{key} removed" if value is None else f"{key} = {value}" for key, value in values.items())
    return told if len(told) <= longest else f"{told[:longest]}..."
