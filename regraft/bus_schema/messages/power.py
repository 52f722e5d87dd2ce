"""Power drawn and energy left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Joules, Ratio, Seconds, Watts
from regraft.bus_schema.encoding.registry import message


@message("regraft/EnergyUse")
@dataclass(frozen=True, slots=True)
class EnergyUse:
    """Energy that ``consumer`` took at once, for instance for one picture."""

    stamp: Seconds
    consumer: str
    energy: Annotated[Joules, Bounds(minimum=0.0)]


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


@message("regraft/ChargerState")
@dataclass(frozen=True, slots=True)
class ChargerState:
    """Whether the robot stands on a charger, and the power that this one gives."""

    stamp: Seconds
    connected: bool
    power: Annotated[Watts, Bounds(minimum=0.0)]


@message("regraft/Charge")
@dataclass(frozen=True, slots=True)
class Charge:
    """Goal of the action ``charge``: stand on the dock until the battery is this full."""

    until: Ratio = 0.98


@message("regraft/ChargeProgress")
@dataclass(frozen=True, slots=True)
class ChargeProgress:
    """Feedback: how full the battery is, what is done for it now, and how long it takes from here."""

    charge: Ratio
    phase: str
    time_left: Seconds


@message("regraft/Charged")
@dataclass(frozen=True, slots=True)
class Charged:
    """Result: whether the battery is as full as was asked for, and why not."""

    charged: bool
    charge: Ratio
    reason: str = ""
