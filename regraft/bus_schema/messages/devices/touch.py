"""Touches of a robot."""

from __future__ import annotations

from dataclasses import dataclass

from regraft.bus_schema.annotations import Count, Radians, Seconds
from regraft.bus_schema.encoding.registry import message


@dataclass(frozen=True, slots=True)
class Touch:
    """A touched body, the sector of the bumper, and the bearing of the touch.

    The bearing is about z of the robot's base, positive to the left. Sector 0 is centred on the front (x forward); the
    sectors count counter-clockwise. ``body`` is empty where the bumper only seems to be pressed.
    """

    body: str
    sector: Count
    bearing: Radians


@message("regraft/BumperState")
@dataclass(frozen=True, slots=True)
class BumperState:
    """The touches since the last message, ordered by body and sector, of a bumper of so many equal ``sectors``."""

    stamp: Seconds
    frame: str
    sectors: Count
    touches: tuple[Touch, ...] = ()
