"""Messages of the stubs: where the search is, what was found and inspected, and how full the battery is."""

from __future__ import annotations

from dataclasses import dataclass

from regraft.bus_schema.annotations import Metres, Ratio, Seconds
from regraft.bus_schema.encoding.registry import message


@message("suave/Search")
@dataclass(frozen=True, slots=True)
class Search:
    """The altitude over the ground at which the vehicle has searched since the message before."""

    stamp: Seconds
    altitude: Metres


@message("suave/Detection")
@dataclass(frozen=True, slots=True)
class Detection:
    """Whether the pipeline has been seen."""

    stamp: Seconds
    detected: bool


@message("suave/Inspection")
@dataclass(frozen=True, slots=True)
class Inspection:
    """The length of pipeline that was inspected, and whether that is all of it."""

    stamp: Seconds
    distance: Metres
    inspected: bool


@message("suave/BatteryLevel")
@dataclass(frozen=True, slots=True)
class BatteryLevel:
    """The charge of the battery: 1 is full."""

    stamp: Seconds
    level: Ratio


@message("suave/Recharge")
@dataclass(frozen=True, slots=True)
class Recharge:
    """Request: fill the battery."""


@message("suave/Recharged")
@dataclass(frozen=True, slots=True)
class Recharged:
    """Reply: the battery is full."""

    level: Ratio
