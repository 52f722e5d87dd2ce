"""Curves of qualities as people write them: ``safety=0:0,0.5:0.8,1:1``, each point a value and its utility."""

from __future__ import annotations

import math
from typing import Final

MAX_CURVE_LENGTH: Final = 4000
"""Characters of one curve."""
FORM: Final = "QUALITY=VALUE:UTILITY,VALUE:UTILITY"

Points = tuple[tuple[float, float], ...]


def read_curve(text: str) -> tuple[str, Points]:
    """Return the quality and the points that a text means; raises ValueError.

    >>> read_curve("safety=0:0,1:0.5")
    ('safety', ((0.0, 0.0), (1.0, 0.5)))
    """
    if len(text) > MAX_CURVE_LENGTH:
        raise ValueError(f"{text[:40]!r}... has {len(text)} characters, must have at most {MAX_CURVE_LENGTH}")
    quality, equals, points = text.partition("=")
    quality = quality.strip()
    if not equals or not quality:
        raise ValueError(f"{text!r} must look like {FORM}")
    return quality, tuple(_point(quality, point) for point in points.split(","))


def _point(quality: str, text: str) -> tuple[float, float]:
    value, colon, utility = text.partition(":")
    if not colon:
        raise ValueError(f"{quality}: {text!r} must look like VALUE:UTILITY")
    return _number(quality, value), _number(quality, utility)


def _number(quality: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{quality}: {text!r} must be a finite number")
    return number
