"""Quality requirements: how well each is met, as the mission's quality decorators measure it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Ratio, Seconds
from regraft.bus_schema.encoding.registry import message


class QualityLevel(Enum):
    """The scope of a requirement (ReBeT, section III-B): one task, or the whole system."""

    TASK = "task"
    SYSTEM = "system"


@message("regraft/Quality")
@dataclass(frozen=True, slots=True)
class Quality:
    """How well a quality requirement is met.

    ``requirement`` is its name on the bus (``SYSTEM/quality/REQUIREMENT``), unique in the tree; ``node`` is the path of
    its decorator; ``attribute`` is such as Safety or Power. ``metric`` is the measure, in the requirement's own unit.
    ``measured`` is when the data behind it were true. ``mean`` is its mean over the seconds for which it was known.
    ``degree`` is how far the requirement is satisfied, ``satisfied`` the same as yes or no. An unknown value is None: a
    metric without data, or with stale ones. ``satisfied`` is None also where nothing is required. ``status`` is a word
    for people and trees, ``reason`` is why the metric is unknown. The decorated task runs only while ``active``;
    otherwise the values are the last that were known.
    """

    stamp: Seconds
    requirement: str
    attribute: str
    node: str = ""
    level: QualityLevel = QualityLevel.TASK
    metric: float | None = None
    measured: Seconds | None = None
    mean: float | None = None
    satisfied: bool | None = None
    degree: Ratio | None = None
    status: str = ""
    reason: str = ""
    weight: Annotated[float, Bounds(minimum=0.0)] = 1.0
    higher_is_better: bool = True
    active: bool = True
