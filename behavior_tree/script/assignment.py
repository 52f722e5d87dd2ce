"""How scripts write blackboard entries: later values are converted to the type of the one that is there.

A script gives no entry a type. As in BehaviorTree.CPP, the first write of a node fixes that.
"""

from collections.abc import Mapping
from typing import Any

from ..data.blackboard import Blackboard, Entry
from ..data.values import from_text, to_type
from ..errors import ScriptError
from .operators import BINARY, number_from_text


def entry_for(board: Blackboard, name: str, create: bool) -> Entry:
    """Return the entry that an assignment writes.

    Raises:
        ScriptError: There is none and the operator does not create any.
    """
    entry = board.find(name)
    if entry is None:
        if not create:
            raise ScriptError(f"there is no blackboard entry '{name}'; create it with ':='")
        entry = board.declare(name)
    return entry


def assign(board: Blackboard, name: str, entry: Entry, value: Any, enums: Mapping[str, int]) -> Any:
    """Write a value as ``:=`` and ``=`` do; return what the entry holds then.

    Text for an entry that holds a number may be the name of one.

    Raises:
        ScriptError: The value cannot become one of the entry's type.
    """
    if value is None:
        raise ScriptError(f"cannot assign to '{name}': the right side is an empty entry")
    if isinstance(value, str):
        stored = _text(board, name, entry, value, enums)
    elif entry.value is None:
        # A number keeps its own type here even if a port declared another: BehaviorTree.CPP does the same.
        stored = value
    else:
        stored = _next_value(board, name, entry, value)
    board.store(entry, stored)
    return stored


def assign_combined(
    board: Blackboard, name: str, entry: Entry, operator: str, value: Any, enums: Mapping[str, int]
) -> Any:
    """Write an entry combined with a value, as ``+=`` and its like do; return what it holds then.

    Args:
        board: The board of the script.
        name: The entry's name.
        entry: The entry.
        operator: The binary operator, such as ``+``.
        value: The right side.
        enums: Names of whole numbers.

    Raises:
        ScriptError: The entry is empty, or the operator does not work on such values.
    """
    if entry.value is None or value is None:
        raise ScriptError(f"'{operator}=' needs two values; '{name}' or the right side is empty")
    return assign(board, name, entry, BINARY[operator](entry.value, value), enums)


def _text(board: Blackboard, name: str, entry: Entry, text: str, enums: Mapping[str, int]) -> Any:
    current, kind = entry.value, entry.type
    if isinstance(current, str) or (current is None and (kind is None or kind is str)):
        return text
    if kind is not None:
        return _parsed(board, name, entry, text, enums)
    if isinstance(current, int | float):
        # The entry is a script's own, without a type: BehaviorTree.CPP makes it a real, even if it was whole.
        return float(_number(name, text, enums))
    raise ScriptError(f"'{name}' holds a {type(current).__name__}; cannot assign {text!r} to it")


def _next_value(board: Blackboard, name: str, entry: Entry, value: Any) -> Any:
    current = entry.value
    if isinstance(current, int | float) and isinstance(value, int | float):
        return _like(board, name, current, value)
    if isinstance(current, str):
        raise ScriptError(f"'{name}' holds text; cannot assign {value!r} to it")
    if isinstance(value, type(current)) or isinstance(current, type(value)):
        return value
    raise ScriptError(f"'{name}' holds a {type(current).__name__}; cannot assign {value!r} to it")


def _like(board: Blackboard, name: str, current: Any, value: float) -> Any:
    if isinstance(current, float):
        return float(value)
    try:
        return to_type(value, type(current), board.converters)
    except ValueError as error:
        raise ScriptError(f"cannot change '{name}' from {current} to {value}: {error}") from None


def _parsed(board: Blackboard, name: str, entry: Entry, text: str, enums: Mapping[str, int]) -> Any:
    try:
        return from_text(text, entry.type, board.converters)
    except ValueError as error:
        if isinstance(entry.value, int | float):
            return _like(board, name, entry.value, _number(name, text, enums))
        raise ScriptError(f"cannot assign text to '{name}': {error}") from error


def _number(name: str, text: str, enums: Mapping[str, int]) -> float:
    try:
        return number_from_text(text, enums)
    except ScriptError as error:
        raise ScriptError(f"cannot assign to '{name}': {error.message}") from error
