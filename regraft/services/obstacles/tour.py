"""Short tours."""

from __future__ import annotations

import math
from itertools import pairwise

from regraft.planar import FloatArray


def short_tour(lengths: FloatArray) -> list[int]:
    """Return a short order in which to visit the places 1 to N, starting from place 0 and ending anywhere.

    `lengths` (N + 1, N + 1) are those of the ways between them. The nearest comes next, then parts of the tour are
    turned round while that shortens it (2-opt).
    """
    tour = [0]
    left = set(range(1, len(lengths)))
    while left:
        nearest = min(left, key=lambda place: (lengths[tour[-1], place], place))
        tour.append(nearest)
        left.remove(nearest)
    while (better := _shorter(tour, lengths)) is not None:
        tour = better
    return tour[1:]


def tour_length(tour: list[int], lengths: FloatArray) -> float:
    """Return the length of a tour that begins at its first place."""
    return math.fsum(float(lengths[here, there]) for here, there in pairwise(tour))


def _shorter(tour: list[int], lengths: FloatArray) -> list[int] | None:
    """Return the tour with one part turned round, if that makes it shorter."""
    length = tour_length(tour, lengths)
    for first in range(1, len(tour) - 1):
        for last in range(first + 1, len(tour)):
            turned = tour[:first] + tour[first : last + 1][::-1] + tour[last + 1 :]
            if tour_length(turned, lengths) < length - 1e-9:
                return turned
    return None
