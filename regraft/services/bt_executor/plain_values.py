"""Values of a blackboard as plain data."""

from __future__ import annotations

import math
from typing import Any

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import SchemaError

MAX_TEXT_LENGTH = 2000
DEEPEST = 6


def shown(value: Any, depth: int = 0) -> PlainValue:
    """Return a value as plain data to be looked at; what is no plain data is shown as text."""
    if is_plain(value):
        return value
    if isinstance(value, float):
        return str(value)
    if depth < DEEPEST:
        if isinstance(value, list | tuple):
            return [shown(item, depth + 1) for item in value]
        if isinstance(value, dict):
            return {str(key): shown(item, depth + 1) for key, item in value.items()}
        try:
            return shown(codec.to_plain(value), depth + 1)
        except SchemaError:
            pass
    return shown_text(str(value))


def shown_text(text: str) -> str:
    """Return text as it can be published: not too long, and such that it can be encoded."""
    return text[:MAX_TEXT_LENGTH].encode("utf-8", "replace").decode()


def is_plain(value: Any, depth: int = 0) -> bool:
    """Return whether a value can travel as plain data and be the same afterwards."""
    if isinstance(value, float):
        return not math.isnan(value)
    if isinstance(value, list) and depth < DEEPEST:
        return all(is_plain(item, depth + 1) for item in value)
    if isinstance(value, dict) and depth < DEEPEST:
        return all(is_plain(key) and isinstance(key, str) and is_plain(item, depth + 1) for key, item in value.items())
    if isinstance(value, int) and not isinstance(value, bool):
        return -(2**63) <= value < 2**63
    if isinstance(value, str):
        return len(value) <= MAX_TEXT_LENGTH and _is_unicode(value)
    return value is None or isinstance(value, bool)


def _is_unicode(text: str) -> bool:
    """Return whether text can be encoded; JSON may hold halves of characters."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
