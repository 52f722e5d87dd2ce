"""The numbers in what is known of the world."""

from __future__ import annotations

import math

from regraft.bus_schema.annotations import PlainValue


def numbers_of(context: dict[str, PlainValue]) -> dict[str, float]:
    """Return the finite numbers of a context, those of maps within it by dotted names; true counts as 1, false as 0.

    >>> numbers_of({"darkness": 0.4, "node": "drive", "qualities": {"safe": {"value": 2, "satisfied": True}}})
    {'darkness': 0.4, 'qualities.safe.value': 2.0, 'qualities.safe.satisfied': 1.0}
    """
    found: dict[str, float] = {}
    _gather(context, "", found)
    return found


def _gather(values: dict[str, PlainValue], prefix: str, found: dict[str, float]) -> None:
    for name, value in values.items():
        if isinstance(value, dict):
            _gather(value, f"{prefix}{name}.", found)
        elif isinstance(value, int | float) and math.isfinite(value):
            found[prefix + name] = float(value)
