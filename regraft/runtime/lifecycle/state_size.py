"""How large a state may be: packing it keeps the loop, and a loop that is kept for too long counts as hung."""

from __future__ import annotations

from collections.abc import Collection

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage

MAX_BYTES = 64 * 1024 * 1024
MAX_VALUES = 250_000
"""Values in a state, those in lists and maps included."""


SCALARS = frozenset((int, float, bool, type(None)))


def check_size(state: PlainValue) -> None:
    """Raise BadMessage if a state is too large; the look at it takes no longer than at the largest allowed."""
    size = values = 0
    waiting: list[object] = [state]
    while waiting:
        value = waiting.pop()
        inner: Collection[object] = ()
        if isinstance(value, dict):
            inner = (*value.keys(), *value.values()) if values + len(value) <= MAX_VALUES else value
        elif isinstance(value, list | tuple):
            inner = value
        else:
            size += len(value) if isinstance(value, str | bytes | bytearray) else 0
        values += len(inner)
        if values > MAX_VALUES or size > MAX_BYTES:
            limits = f"{MAX_BYTES // 1024**2} MB and {MAX_VALUES:,} values"
            raise BadMessage(f"state: is too large: must have at most {limits}")
        waiting += [one for one in inner if type(one) not in SCALARS]
