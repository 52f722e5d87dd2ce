"""Rules that enter modes by themselves: a condition, and the mode that is to be while it holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Seconds
from regraft.bus_schema.encoding.registry import message

LONGEST = 86_400.0
"""The most seconds that a rule may settle or dwell."""


@message("regraft/ModeRule")
@dataclass(frozen=True, slots=True)
class ModeRule:
    """While the expression ``when`` holds, ``mode`` is to be; of several rules that hold, the first listed one counts.

    ``start`` are the modes from which it leads; empty: from any. The condition has to hold for ``settle`` seconds
    first. The mode then stays for ``dwell`` seconds at the least. None: by the planner's parameters.
    """

    name: str
    when: str
    mode: str
    start: tuple[str, ...] = ()
    settle: Annotated[Seconds, Bounds(0.0, LONGEST)] | None = None
    dwell: Annotated[Seconds, Bounds(0.0, LONGEST)] | None = None
    because: str = ""
