"""Bounds of qualities as people write them: ``safety>=0.5``, ``energy<=0.4``, ``speed=0.2`` or ``speed: 0.2``."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Final

MAX_BOUND_LENGTH: Final = 300
"""Characters of one bound."""
FORMS: Final = "QUALITY>=NUMBER, QUALITY<=NUMBER or QUALITY=NUMBER"
_BOUND: Final = re.compile(r"\s*([^\s<>=:!]+)\s*([<>=:!]+)\s*(\S+)\s*")


class Comparison(Enum):
    """How a measured quality is compared with its bound."""

    AT_LEAST = ">="
    AT_MOST = "<="


@dataclass(frozen=True, slots=True)
class Bound:
    """A bound of a quality; ``comparison`` is None where the direction of the quality decides."""

    quality: str
    number: float
    comparison: Comparison | None = None


def read_bound(text: str) -> Bound:
    """Return the bound that a text means; raises ValueError.

    >>> read_bound("safety >= 0.5").comparison, read_bound("speed=0.2").number
    (<Comparison.AT_LEAST: '>='>, 0.2)
    """
    if len(text) > MAX_BOUND_LENGTH:
        raise ValueError(f"{text[:40]!r}... has {len(text)} characters, must have at most {MAX_BOUND_LENGTH}")
    match = _BOUND.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} must look like {FORMS}")
    quality, sign, number = match.groups()
    if sign in ("=", ":"):
        return Bound(quality, _number(quality, number))
    if sign not in (each.value for each in Comparison):
        raise ValueError(f"{quality}: {sign!r} compares no bound: must be >=, <= or =")
    return Bound(quality, _number(quality, number), Comparison(sign))


def read_bounds(texts: Iterable[str]) -> dict[str, Bound]:
    """Return bounds by their qualities; raises ValueError for a text that means none, or a second one of a quality."""
    found: dict[str, Bound] = {}
    for bound in map(read_bound, texts):
        if bound.quality in found:
            raise ValueError(f"{bound.quality}: has two numbers: leave one out")
        found[bound.quality] = bound
    return found


def _number(quality: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        raise ValueError(f"{quality}: {text!r} is not a number") from None
    if not math.isfinite(number):
        raise ValueError(f"{quality}: {text} is not finite: a bound must be")
    return number
