"""Names for things that keep from one map to the next."""

from __future__ import annotations

import math
from collections.abc import Sequence

from regraft.planar import Point

SAME = 0.35
"""m: what is found this near to where a thing was is that thing."""


class Names:
    """Gives things names, `object_1` and so on, and the same names to those found again.

    A thing that is not found for a while, as when noise hides it, keeps its name for its return.
    """

    def __init__(self) -> None:
        self._known: dict[str, Point] = {}

    def name(self, centres: Sequence[Point]) -> list[str]:
        """Return a name for each of some places (m); the nearest pairs of old and new places are matched first."""
        pairs = sorted(
            (math.dist(centre, known), i, name)
            for i, centre in enumerate(centres)
            for name, known in self._known.items()
        )
        names: dict[int, str] = {}
        for distance, i, name in pairs:
            if distance <= SAME and i not in names and name not in names.values():
                names[i] = name
        for i, centre in enumerate(centres):
            names.setdefault(i, f"object_{len(self._known) + 1}")
            self._known[names[i]] = centre
        return [names[i] for i in range(len(centres))]

    def snapshot(self) -> dict[str, list[float]]:
        """Return the names and places as plain data."""
        return {name: list(place) for name, place in self._known.items()}

    def restore(self, state: dict[str, list[float]]) -> None:
        """Take over the names of a snapshot."""
        self._known = {name: (x, y) for name, (x, y) in state.items()}
