"""Hints for a name that does not exist: the nearest one, or all that there are."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

LISTED = 12


def near(name: str, known: Iterable[str]) -> str | None:
    """Return the name of ``known`` that may have been meant by ``name``, None if none is near.

    >>> near("max_velocty", ["max_velocity", "frame"])
    'max_velocity'
    """
    found = difflib.get_close_matches(name[:200], sorted(set(known)), n=1)
    return found[0] if found else None


def instead_of(name: str, known: Iterable[str], *, none: str = "there are none") -> str:
    """Say what may have been meant by ``name``: a near name of ``known``, or what names there are.

    >>> instead_of("max_velocty", ["max_velocity", "frame"])
    "did you mean 'max_velocity'?"
    >>> instead_of("speed", ["max_velocity", "frame"])
    'there are: frame, max_velocity'
    """
    names = sorted(set(known))
    meant = near(name, names)
    if meant is not None:
        return f"did you mean {meant!r}?"
    if not names:
        return none
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return f"there are: {', '.join(names[:LISTED])}{more}"
