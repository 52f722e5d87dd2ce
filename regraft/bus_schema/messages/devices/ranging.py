"""Findings of short-range infrared sensors around a robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Array, FloatArray, Metres, Radians, Seconds
from regraft.bus_schema.encoding.registry import message


@message("regraft/Proximity")
@dataclass(frozen=True, slots=True)
class Proximity:
    """Distances (m) that a ring of sensors measures, +inf where nothing is within ``reach``.

    Sensor i looks along ``bearings[i]`` (rad, about z of ``frame``: 0 is forward, left is positive).
    """

    stamp: Seconds
    frame: str
    reach: Metres
    bearings: Annotated[FloatArray, Array("<f4", (None,))]
    distances: Annotated[FloatArray, Array("<f4", (None,))]


@dataclass(frozen=True, slots=True)
class BeaconSighting:
    """A beacon in sight: its bearing about z of ``frame`` (0 is forward, left is positive), and its distance."""

    beacon: str
    bearing: Radians
    distance: Metres


@message("regraft/BeaconSightings")
@dataclass(frozen=True, slots=True)
class BeaconSightings:
    """The beacons that a receiver sees, in the order of the robots in their world; ``frame`` is the robot's base."""

    stamp: Seconds
    frame: str
    beacons: tuple[BeaconSighting, ...] = ()
