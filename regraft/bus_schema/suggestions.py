"""Hints for a name that does not exist: the nearest one, or all that there are."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from itertools import takewhile

LISTED = 12
CANDIDATES = 5
SEPARATOR = re.compile("[/.:]")
MAX_HINTS = 20
"""Names of one request for which a near one is looked up: that takes a fifth of a millisecond each."""


def near(name: str, known: Iterable[str]) -> str | None:
    """Return the name of ``known`` that may have been meant by ``name``, None if none is near.

    A package that two names share makes them no nearer.

    >>> near("max_velocty", ["max_velocity", "frame"])
    'max_velocity'
    >>> near("regraft/Twits", ["regraft/JoinHost", "regraft/Twist"])
    'regraft/Twist'
    >>> near("regraft/Twist", ["regraft/JoinHost"])
    """
    found = difflib.get_close_matches(name[:200], sorted(set(known)), n=CANDIDATES)
    return next((other for other in found if _own_parts_are_near(name[:200], other)), None)


def _own_parts_are_near(one: str, other: str) -> bool:
    """Return whether two names are near without the packages that they share."""
    parts, others = SEPARATOR.split(one), SEPARATOR.split(other)
    shared = len(list(takewhile(lambda pair: pair[0] == pair[1], zip(parts, others, strict=False))))
    own, own_other = ".".join(parts[shared:]), ".".join(others[shared:])
    return not (own and own_other) or bool(difflib.get_close_matches(own, [own_other]))


def instead_of(name: str, known: Iterable[str], *, none: str = "there are none") -> str:
    """Report what may have been meant by ``name``: a near name of ``known``, or what names there are.

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


def no_such(kind: str, name: str, known: Iterable[str]) -> str:
    """Return that nothing of a kind has that name, and what may have been meant.

    >>> no_such("mode", "dak", ["dark"])
    "there is no mode 'dak'; did you mean 'dark'?"
    """
    return f"there is no {kind} {name!r}; {instead_of(name, known)}"


class Hints:
    """Reports ``instead_of`` for each of many names that do not exist; behind the first few, that there are others."""

    def __init__(self, known: Iterable[str]) -> None:
        """Suggest names of ``known``."""
        self._known = sorted(set(known))
        self._left = MAX_HINTS

    def instead_of(self, name: str) -> str:
        """Report what may have been meant by ``name``."""
        if not self._left:
            return f"there are {len(self._known)} others"
        self._left -= 1
        return instead_of(name, self._known)

    def no_such(self, kind: str, name: str) -> str:
        """Return that nothing of a kind has that name, and what may have been meant."""
        return f"there is no {kind} {name!r}; {self.instead_of(name)}"
