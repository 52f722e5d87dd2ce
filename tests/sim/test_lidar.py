"""Promises about the laser scanner."""

import math
from dataclasses import replace

import numpy as np
import pytest

from regraft.sim_service.devices.core.failure_schedule import BIAS, NOISE, NONE
from regraft.sim_service.devices.lidar import Lidar
from regraft.sim_service.layout.scene import load_scene
from regraft.sim_service.robots import Place
from regraft.sim_service.simulation import Simulation
from tests.support.worlds import WORLD, turn_of, waffle

from .worlds import drive, frog_with_robot_at

EXACT = {"noise": 0.0}
LIDAR_X = -0.064
WEST, SOUTH = -2.351, -2.29
"""The inner faces (m) of two walls."""


@pytest.mark.parametrize("yaw", [0.0, 0.6, -2.0])
def test_ranges_to_the_walls_are_exact(yaw: float) -> None:
    simulation = frog_with_robot_at(-1.2, -1.2, yaw, scan=EXACT)
    scan = turn_of(simulation)
    x, y = -1.2 + LIDAR_X * math.cos(yaw), -1.2 + LIDAR_X * math.sin(yaw)
    checked = 0
    for beam, measured in enumerate(scan.ranges.tolist()):
        angle = math.remainder(yaw + scan.angle_min + beam * scan.angle_increment, 2.0 * math.pi)
        if math.radians(-25.0) < angle < math.radians(130.0):
            continue
        to_west = (WEST - x) / math.cos(angle) if math.cos(angle) < 0.0 else math.inf
        to_south = (SOUTH - y) / math.sin(angle) if math.sin(angle) < 0.0 else math.inf
        assert measured == pytest.approx(min(to_west, to_south), abs=1e-3)
        checked += 1
    assert checked > 180


def test_nothing_in_range_reads_infinity() -> None:
    simulation = frog_with_robot_at(-1.0, -1.0, 0.0)
    scan = turn_of(simulation)
    assert np.isinf(scan.ranges).any()
    finite = scan.ranges[np.isfinite(scan.ranges)]
    assert finite.min() >= scan.range_min
    assert finite.max() <= scan.range_max


def beside_the_west_wall(distance: float, **parameters: float) -> Lidar:
    """Return the lidar of a robot that looks along the western wall, at a distance (m) from it."""
    simulation = frog_with_robot_at(WEST + distance, -1.2, -math.pi / 2.0, scan=parameters)
    return simulation.robot().device("scan", Lidar)


@pytest.mark.parametrize("failing", [NONE, BIAS, NOISE])
@pytest.mark.parametrize("parameters", [EXACT, {}], ids=["exact", "noisy"])
def test_a_wall_that_is_too_near_to_be_measured_is_no_open_space(parameters: dict[str, float], failing: str) -> None:
    lidar = beside_the_west_wall(0.119, **parameters)
    lidar.kit.failing = failing
    ranges = lidar.measure().ranges
    # The wall is to the right. To the left, the next thing is beyond the lidar's reach.
    assert np.isneginf(ranges[268:273]).all()
    assert np.isneginf(ranges).sum() < 30
    assert np.isposinf(ranges[80:100]).any()
    assert not np.isneginf(beside_the_west_wall(0.121, **EXACT).turn().ranges).any()


def test_the_robot_does_not_see_itself() -> None:
    simulation = frog_with_robot_at(0.0, -1.0, 0.0)
    for _ in range(20):
        drive(simulation, 0.0, 1.5, 0.25)
        assert turn_of(simulation).ranges.min() > 0.5


def test_noise_has_the_size_it_is_given() -> None:
    noisy, exact = frog_with_robot_at(-1.2, -1.2, 0.3), frog_with_robot_at(-1.2, -1.2, 0.3, scan=EXACT)
    with_noise, without = turn_of(noisy).ranges, turn_of(exact).ranges
    measured = np.isfinite(without)
    assert np.std(with_noise[measured] - without[measured]) == pytest.approx(0.01, rel=0.2)


def test_each_lidar_at_a_site_has_noise_of_its_own_and_the_first_keeps_its() -> None:
    alone = waffle(place=Place(-1.2, -1.2))
    (lidar,) = (spec for spec in alone.devices if spec.name == "scan")
    both = replace(alone, devices=(*alone.devices, replace(lidar, name="spare")))
    one, two = (Simulation(load_scene(WORLD, (robot,)), 1) for robot in (alone, both))
    first, second = (two.robot().device(name, Lidar).turn().ranges for name in ("scan", "spare"))
    np.testing.assert_array_equal(first, turn_of(one).ranges)
    measured = np.isfinite(first)
    np.testing.assert_array_equal(measured, np.isfinite(second))
    apart = first[measured] - second[measured]
    assert np.std(apart) == pytest.approx(0.01 * math.sqrt(2.0), rel=0.2)


def test_reading_a_scan_changes_nothing() -> None:
    read, unread = frog_with_robot_at(0.0, -1.0, 0.0), frog_with_robot_at(0.0, -1.0, 0.0)
    for _ in range(20):
        drive(read, 0.1, 0.5, 0.1)
        drive(unread, 0.1, 0.5, 0.1)
        np.testing.assert_array_equal(turn_of(read).ranges, turn_of(read).ranges)
    assert read.digest() == unread.digest()
    np.testing.assert_array_equal(turn_of(read).ranges, turn_of(unread).ranges)
