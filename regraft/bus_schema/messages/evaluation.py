"""The result of a run."""

from __future__ import annotations

from dataclasses import dataclass

from regraft.bus_schema.annotations import Count, Metres, Seconds
from regraft.bus_schema.encoding.registry import message


@message("regraft/RunSummaryRequest")
@dataclass(frozen=True, slots=True)
class RunSummaryRequest:
    """Request: sum the run up to now."""


@message("regraft/RunSummary")
@dataclass(frozen=True, slots=True)
class RunSummary:
    """Reply: a run up to ``stamp``. Equal runs have equal digests.

    ``contacts`` counts how often the robot began to touch something, ``visits`` how often it was at each goal.
    ``pictures`` and ``hits`` count, by camera, the pictures looked at and those in which something was found.
    ``adaptations`` counts those that ended, by outcome.
    """

    stamp: Seconds
    digest: str
    ticks: Count
    contacts: Count
    distance: Metres
    visits: dict[str, Count]
    pictures: dict[str, Count]
    hits: dict[str, Count]
    adaptations: dict[str, Count]
