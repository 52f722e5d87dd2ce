"""Utility curves: the utility of a quality's value, linear between points.

Cheng, Garlan, Schmerl, "Architecture-based self-adaptation in the presence of multiple objectives" (SEAMS 2006): a
utility is from 0 to 1, given at some points, and interpolated between them.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, TypeAlias

MAX_POINTS: Final = 100
LONGEST_TEXT: Final = 10_000
NUMBER: Final = r"-?[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?"
POINT: Final = re.compile(rf"\s*({NUMBER})\s*:\s*({NUMBER})\s*")

Points: TypeAlias = Sequence[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Curve:
    """A utility for each value of a quality; raises ValueError for points that are no curve.

    ``points`` are values and their utilities. Below the first and above the last value, the utility of that one holds.
    """

    points: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        problem = curve_problem(self.points)
        if problem:
            raise ValueError(problem)

    def utility(self, value: float) -> float:
        """Return the utility of a value.

        >>> Curve(((0, 0), (0.5, 0.8), (1, 1))).utility(0.25)
        0.4
        """
        place = bisect_right(self.points, (value, math.inf))
        if place == 0:
            return self.points[0][1]
        if place == len(self.points):
            return self.points[-1][1]
        (low, start), (high, end) = self.points[place - 1 : place + 1]
        # The difference of two huge values may be infinite: that of their halves is not.
        scale = 1.0 if math.isfinite(high - low) else 0.5
        share = (value * scale - low * scale) / (high * scale - low * scale)
        return start + share * (end - start)

    @property
    def worst(self) -> float:
        """Return the lowest utility of the curve."""
        return min(utility for _, utility in self.points)

    def __str__(self) -> str:
        """Return the points as files have them: ``0: 0, 0.5: 0.8, 1: 1``."""
        return ", ".join(f"{_shown(value)}: {_shown(utility)}" for value, utility in self.points)


def curve_problem(points: Points) -> str:
    """Return why points are no curve, empty if they are one."""
    if not 2 <= len(points) <= MAX_POINTS:
        return f"a curve has {len(points)} points, must have 2 to {MAX_POINTS}"
    for value, utility in points:
        if not math.isfinite(value):
            return f"the value {value:g} of a curve must be a finite number"
        if not 0.0 <= utility <= 1.0:
            return f"the utility {utility:g} of a curve must be from 0 to 1"
    for (before, _), (value, _) in pairwise(points):
        if value <= before:
            return f"the value {value:g} of a curve is behind {before:g}: values must increase"
    return ""


def curve_of(text: str) -> Curve:
    """Return the curve that a text holds; raises ValueError.

    >>> curve_of("0: 0, 0.5: 0.8, 1: 1").points
    ((0.0, 0.0), (0.5, 0.8), (1.0, 1.0))
    """
    if len(text) > LONGEST_TEXT:
        raise ValueError(f"a curve has {len(text)} characters, must have at most {LONGEST_TEXT}")
    points: list[tuple[float, float]] = []
    for part in text.split(","):
        found = POINT.fullmatch(part)
        if found is None:
            raise ValueError(f"{part.strip()[:40]!r} is no point of a curve, must be VALUE: UTILITY")
        points.append((float(found[1]), float(found[2])))
    return Curve(tuple(points))


def _shown(number: float) -> str:
    return repr(float(number)).removesuffix(".0")
