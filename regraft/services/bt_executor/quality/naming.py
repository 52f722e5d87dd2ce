"""Names of requirements that can be part of a key of the bus, each unique in its tree."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Final
from zlib import crc32

_FORBIDDEN: Final = re.compile(r"[^A-Za-z0-9_-]+")
_LONGEST: Final = 64


def key_safe(name: str) -> str:
    """Return a name, at most 64 long, with ``_`` for every run of characters that a key does not take."""
    safe = _FORBIDDEN.sub("_", name) or "_"
    if safe.startswith("-"):
        safe = "_" + safe[1:]
    return safe if len(safe) <= _LONGEST else f"{safe[: _LONGEST - 9]}-{crc32(name.encode('utf-8', 'replace')):08x}"


def bus_names(named: Sequence[tuple[str, str]]) -> list[str]:
    """Return a name for each requirement of a tree, given as (name, path) in the tree's order.

    A name that only one requirement has stays as it is: ``MoveSafely``. Those that share one are distinguished by their
    paths, as ``Drive-MoveSafely``, and where even these are equal, by a number. So a name depends on the tree's XML
    alone. It changes only when another requirement of the same name comes or goes.
    """
    often = Counter(key_safe(name) for name, _ in named)
    taken = {name for name, count in often.items() if count == 1}
    result = []
    for name, path in named:
        safe = key_safe(name)
        if often[safe] > 1:
            safe = _free(key_safe(path.replace("/", "-")), taken)
            taken.add(safe)
        result.append(safe)
    return result


def _free(name: str, taken: set[str]) -> str:
    number, free = 1, name
    while free in taken:
        number += 1
        free = key_safe(f"{name}-{number}")
    return free
