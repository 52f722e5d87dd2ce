"""The credit of a request: the utility that an earlier choice has earned."""

from __future__ import annotations

import math
from dataclasses import dataclass

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage


@dataclass(frozen=True, slots=True)
class Credit:
    """The utility that was measured in ``[begin, end]``, for the option of ``ticket``."""

    ticket: str
    utility: float
    begin: float
    end: float


def read_credit(plain: dict[str, PlainValue]) -> Credit:
    """Return the credit of a request's inputs; raises BadMessage naming what is wrong, and where."""
    try:
        return _credit(plain)
    except BadMessage as error:
        raise error.inside("credit") from None


def _credit(plain: dict[str, PlainValue]) -> Credit:
    names = ("ticket", "utility", "from", "to")
    unknown, missing = sorted(plain.keys() - set(names)), [name for name in names if name not in plain]
    if unknown or missing:
        what = f"has no field {unknown[0]!r}" if unknown else f"lacks {missing[0]!r}"
        raise BadMessage(f"{what}; it has: {', '.join(names)}")
    if not isinstance(plain["ticket"], str):
        raise BadMessage(f"is {type(plain['ticket']).__name__}, must be text", ("ticket",))
    utility, begin, end = (_number(plain, name) for name in names[1:])
    if end < begin:
        raise BadMessage(f"is {seconds(end)}, before 'from', which is {seconds(begin)}", ("to",))
    return Credit(plain["ticket"], utility, begin, end)


def seconds(stamp: float) -> str:
    """Return a stamp as text: to the millisecond, also where it counts from 1970."""
    return f"{stamp:.3f}".rstrip("0").rstrip(".")


def _number(plain: dict[str, PlainValue], name: str) -> float:
    value = plain[name]
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise BadMessage(f"is {value!r}, must be a finite number", (name,))
    return float(value)
