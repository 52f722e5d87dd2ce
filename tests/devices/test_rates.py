"""Promises about when sensors measure, and that sensors of one kind have random numbers of their own."""

import math
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.bus_schema.messages.sensors import LaserScan
from regraft.sim_service.devices.bumper import Bumper
from regraft.sim_service.devices.core.failure_schedule import DROPOUT
from regraft.sim_service.devices.lidar import Lidar
from regraft.sim_service.devices.light_sensor import LightSensor
from regraft.sim_service.simulation import Simulation

from .worlds import PUCK, WALL, device, found, listen, robot, run, simulated

LAMP = '<geom type="plane" size="5 5 .1"/><light pos="0 0 2" attenuation="0 0 1" exponent="0"/>'
EYE = PUCK + '<site name="lidar" pos="0 0 .05"/><site name="rear" pos="0 0 .06"/>'


@pytest.mark.parametrize(("rate", "expected"), [(3.0, 3), (7.0, 7), (8.0, 8), (15.0, 15), (50.0, 20)])
def test_a_sensor_measures_as_often_as_asked_for_but_once_a_tick(tmp_path: Path, rate: float, expected: int) -> None:
    simulation = simulated(tmp_path, robot(tmp_path, "", [device(LightSensor, site="top", rate=rate)]), body=LAMP)
    heard = listen(simulation, LightSensor.measures)
    run(simulation, 5.0)
    assert len(heard) == 5 * expected


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from((0.5, 2.0, 3.0, 7.5, 8.0, 12.0, 20.0)))
def test_measurements_are_as_even_as_ticks_allow(tick: int, rate: float) -> None:
    with TemporaryDirectory() as folder:
        kit = found(simulated(Path(folder), robot(Path(folder), "", [device(Bumper)])), Bumper).kit
    period = Fraction(20) / Fraction(rate)
    kit.progress.steps = tick * kit.progress.steps_per_tick
    assert kit.is_due(rate) == (tick // period > (tick - 1) // period)
    assert math.floor(period) <= kit.ticks_since_due(rate) <= math.ceil(period) or not kit.is_due(rate)


def test_two_lidars_of_a_robot_lose_beams_of_their_own(tmp_path: Path) -> None:
    sites = {"front": "lidar", "back": "rear"}
    lidars = [device(Lidar, name, site=site, dropout=0.5, noise=0.0) for name, site in sites.items()]
    simulation = simulated(tmp_path, robot(tmp_path, "", lidars, body=EYE), body=WALL)
    scans = [lost(simulation, name) for name in sites]
    assert scans[0].count(True) > 0
    assert scans[0] != scans[1]


def lost(simulation: Simulation, name: str) -> list[bool]:
    """Return which beams of a lidar find nothing while it loses some."""
    lidar = found(simulation, Lidar, name)
    lidar.kit.failing = DROPOUT
    scan: LaserScan = lidar.measure()
    return [math.isinf(distance) for distance in scan.ranges.tolist()]
