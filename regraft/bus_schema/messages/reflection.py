"""The message of the system reflection to missions: values of topics under the names of blackboard entries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Count, PlainValue, Seconds
from regraft.bus_schema.encoding.registry import message


@message("regraft/ReflectedEntry")
@dataclass(frozen=True, slots=True)
class ReflectedEntry:
    """The newest value of one entry; ``value`` and ``stamp`` are None before the first.

    ``stamp`` is the source message's own, or where it has none the time of its publishing, and ``sequence`` its number.
    From an age of ``stale_after`` on the value is stale; None: no limit is given.
    """

    key: str
    value: PlainValue = None
    stamp: Seconds | None = None
    sequence: Count = 0
    stale_after: Annotated[float, Bounds(minimum=0.0)] | None = None


@message("regraft/ReflectedEntries")
@dataclass(frozen=True, slots=True)
class ReflectedEntries:
    """All entries, in the order of the mapping: the next message makes up for one that was missed."""

    stamp: Seconds
    entries: tuple[ReflectedEntry, ...]
