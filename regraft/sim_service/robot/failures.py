"""Sensor failures by the clock: what is to fail when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Final

import numpy as np
import numpy.typing as npt

from regraft.bus_schema.annotations import Bounds, Seconds
from regraft.sim_service.layout.random_streams import generator

NONE, SILENT, FROZEN, BLACK, DROPOUT, DRIFT = "none", "silent", "frozen", "black", "dropout", "drift"

Since = Annotated[Seconds, Bounds(minimum=0.0)]


class CameraFailure(StrEnum):
    """How a camera fails."""

    NONE = NONE
    BLACK = BLACK
    FROZEN = FROZEN
    SILENT = SILENT


class ScanFailure(StrEnum):
    """How a lidar fails."""

    NONE = NONE
    SILENT = SILENT
    FROZEN = FROZEN
    DROPOUT = DROPOUT


class OdometryFailure(StrEnum):
    """How an odometry fails."""

    NONE = NONE
    SILENT = SILENT
    FROZEN = FROZEN
    DRIFT = DRIFT


CAMERA_FAILURES: Final = tuple(each.value for each in CameraFailure)
SCAN_FAILURES: Final = tuple(each.value for each in ScanFailure)
ODOMETRY_FAILURES: Final = tuple(each.value for each in OdometryFailure)


@dataclass(frozen=True, slots=True)
class CameraFails:
    """From ``at`` on, in simulated time, a camera fails in this way; it works with ``none``."""

    at: Since
    failure: CameraFailure


@dataclass(frozen=True, slots=True)
class ScanFails:
    """From ``at`` on, in simulated time, the lidar fails in this way; it works with ``none``."""

    at: Since
    failure: ScanFailure


@dataclass(frozen=True, slots=True)
class OdometryFails:
    """From ``at`` on, in simulated time, the odometry fails in this way; it works with ``none``."""

    at: Since
    failure: OdometryFailure


Fails = CameraFails | ScanFails | OdometryFails


class ScheduleError(ValueError):
    """A schedule whose entries are out of order; the message names the parameter and the entries."""


class Schedule:
    """The failures of a sensor, in the order of their times."""

    def __init__(self, entries: Sequence[Fails], parameter: str = "failures") -> None:
        self._entries = entries
        for index, (before, entry) in enumerate(pairwise(entries), start=1):
            if entry.at < before.at:
                raise ScheduleError(
                    f"{parameter}.{index}: {entry.at:g} s comes after {before.at:g} s: put the entries in order"
                )

    def at(self, time: float) -> str:
        """Return how the sensor fails at a time (s); ``none`` before the first entry."""
        # Times are sums of ticks, so that a tick can lie a rounding error before the time that is meant.
        return next((entry.failure.value for entry in reversed(self._entries) if entry.at <= time + 1e-6), NONE)


def drop_rays(ranges: npt.NDArray[np.float64], share: float, seed: int, moment: int) -> npt.NDArray[np.float64]:
    """Return ranges (m) of which a share, drawn anew for each moment, are lost as if nothing had been hit."""
    lost = generator(seed, "lidar dropout", moment).random(len(ranges)) < share
    return np.where(lost, np.inf, ranges)
