"""Power drawn and energy left."""

from __future__ import annotations

from dataclasses import dataclass

from bus_schema.annotations import Joules, Ratio, Seconds, Watts
from bus_schema.registry import message


@message("regraft/EnergyUse")
@dataclass(frozen=True, slots=True)
class EnergyUse:
    """Energy that ``consumer`` took at once, for instance for one picture."""

    stamp: Seconds
    consumer: str
    energy: Joules


@message("regraft/PowerDraw")
@dataclass(frozen=True, slots=True)
class PowerDraw:
    """Power that each consumer draws now, and the sum."""

    stamp: Seconds
    total: Watts
    consumers: dict[str, Watts]


@message("regraft/BatteryState")
@dataclass(frozen=True, slots=True)
class BatteryState:
    """Energy left, of how much, as a ratio, and the power drawn."""

    stamp: Seconds
    energy: Joules
    capacity: Joules
    charge: Ratio
    power: Watts
