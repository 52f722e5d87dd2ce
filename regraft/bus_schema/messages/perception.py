"""Detections, and the service ``detect``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Count, Joules, Metres, Radians, Ratio, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.geometry import Vector3


@message("regraft/Detection")
@dataclass(frozen=True, slots=True)
class Detection:
    """One object in a picture: bearing from the camera (left is positive), and its position (m) in ``frame``.

    ``confidence`` grows with light, nearness and a clear shape; each detector documents what it is calibrated to.
    """

    label: str
    confidence: Ratio
    frame: str
    position: Vector3
    bearing: Radians
    distance: Metres


@message("regraft/Detections")
@dataclass(frozen=True, slots=True)
class Detections:
    """The detections in one picture of ``camera``, taken at ``stamp``; empty when nothing was found in it."""

    stamp: Seconds
    camera: str
    objects: tuple[Detection, ...] = ()


@message("regraft/Detect")
@dataclass(frozen=True, slots=True)
class Detect:
    """Request: look for ``label`` in the next ``pictures`` pictures; None for as many as the detector thinks fit."""

    label: str = "hydrant"
    pictures: Annotated[int, Bounds(1, 100)] | None = None


@message("regraft/Sightings")
@dataclass(frozen=True, slots=True)
class Sightings:
    """Reply: how many pictures were looked at, in how many the object was seen, and the best sighting.

    ``useful`` counts the pictures that were neither black nor frozen; None where they were not checked. ``position``
    (m, in ``frame``) is the object's place by all sightings together. ``spread`` is how far from there a sighting
    typically is: None if there was only one. ``paid`` counts the pictures that took energy from the robot's battery,
    ``picture_energy`` each; None where that is not known.
    """

    pictures: Count
    hits: Count
    best: Detection | None = None
    useful: Count | None = None
    position: Vector3 | None = None
    frame: str = ""
    spread: Metres | None = None
    paid: Count | None = None
    picture_energy: Annotated[Joules, Bounds(minimum=0.0)] | None = None
