"""A scan that repeats itself is reported where it shows something, and only there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from regraft.services.mapper.odometry_mapper import OdometryMapper
from regraft.testing import Rig

from .room import Ride


def levels_after(ranges: np.ndarray) -> list[str]:
    """Return what a mapper reports of a moving robot's scan that is the same all the time."""
    with Rig() as rig:
        ride = Ride(rig, OdometryMapper)
        ride.spoil = lambda _: ranges
        ride.go(3.0)
        return ride.levels("scan")


def test_a_lidar_that_has_nothing_within_its_reach_is_well() -> None:
    assert levels_after(np.full(360, math.inf, np.float32)) == []


@pytest.mark.parametrize("lost", [0, 1, 359])
def test_a_frozen_scan_is_reported_with_any_number_of_beams_without_information(lost: int) -> None:
    ranges = np.full(360, 1.0, np.float32)
    ranges[:lost] = math.nan
    assert levels_after(ranges) == ["error"]
