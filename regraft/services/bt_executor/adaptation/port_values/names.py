"""Lists of names in a port."""

from __future__ import annotations

from typing import Any


def read_names(given: Any) -> tuple[str, ...]:
    """Return the items of ``a;b;c``, or of a list of texts.

    Raises:
        ValueError: it is something else.
    """
    if isinstance(given, str):
        return tuple(item.strip() for item in given.split(";") if item.strip())
    if isinstance(given, list | tuple) and all(isinstance(item, str) for item in given):
        return tuple(given)
    raise ValueError(f"{given!r} is no list of names; write a;b;c")
