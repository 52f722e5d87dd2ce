"""Durations as trees write them: ``3``, ``200ms``, ``3s``, ``2min``."""

from __future__ import annotations

import math
import re
from typing import Any, Final

_DURATION: Final = re.compile(r"\s*+(\d++(?:\.\d*+)?|\.\d++)\s*+(?:(ms|s|min|h)\s*+)?")
_SHOWN: Final = 200
_SECONDS: Final = {None: 1.0, "ms": 0.001, "s": 1.0, "min": 60.0, "h": 3600.0}

AT_ONCE: Final = 1e-6
"""Seconds by which a time counts as reached: times are sums of binary fractions."""


def read_duration(given: Any) -> float:
    """Return seconds from a number of them, or from text with a unit.

    Raises:
        ValueError: it is no duration, negative, or infinite.
    """
    if isinstance(given, str):
        found = _DURATION.fullmatch(given)
        if found is None:
            raise ValueError(f"'{given[:_SHOWN]}' is no duration; write seconds, or a unit as in 200ms, 3s, 2min, 1h")
        return float(found.group(1)) * _SECONDS[found.group(2)]
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given) or given < 0:
        raise ValueError(f"{given!r} is no duration; it must be a number of seconds, 0 or more")
    return float(given)
