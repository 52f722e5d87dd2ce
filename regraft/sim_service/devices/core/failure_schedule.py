"""Failures of sensors by the clock: what is to fail when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Final

from regraft.bus_schema.annotations import Bounds, Seconds, Text

NONE, SILENT, FROZEN, BLACK = "none", "silent", "frozen", "black"
DROPOUT, DRIFT, BIAS, NOISE, STUCK, ZEROS = "dropout", "drift", "bias", "noise", "stuck", "zeros"

Since = Annotated[Seconds, Bounds(minimum=0.0)]


class CameraFailure(StrEnum):
    """How a camera fails."""

    NONE = NONE
    BLACK = BLACK
    FROZEN = FROZEN
    SILENT = SILENT


CAMERA_FAILURES: Final = tuple(each.value for each in CameraFailure)


@dataclass(frozen=True, slots=True)
class CameraFails:
    """From ``at`` on, in simulated time, a camera fails in this way; it works with ``none``."""

    at: Since
    failure: CameraFailure


@dataclass(frozen=True, slots=True)
class DeviceFails:
    """From ``at`` on, in simulated time, a robot's device fails in this way; it works with ``none``.

    A device has its name, led by ``ROBOT/`` where its robot has one.
    """

    at: Since
    device: Annotated[str, Text(160)]
    failure: Annotated[str, Text(64)]


Fails = CameraFails | DeviceFails


class Schedule:
    """The failures of a sensor, in the order of their times."""

    def __init__(self, entries: Sequence[Fails]) -> None:
        self._entries = entries

    def at(self, time: float) -> str:
        """Return how the sensor fails at a time (s); ``none`` before the first entry."""
        # Times are sums of ticks, so that a tick can lie a rounding error before the time that is meant.
        return next((str(entry.failure) for entry in reversed(self._entries) if entry.at <= time + 1e-6), NONE)
