"""Promises about inertial units."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from regraft.sim_service.devices.imu import InertialUnit
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.simulation import Simulation

from .worlds import device, found, robot, run, simulated

EXACT: dict[str, Any] = {"gyro_noise": 0.0, "gyro_walk": 0.0, "force_noise": 0.0, "force_walk": 0.0}
BODY = '<geom type="box" size=".1 .1 .02" pos="0 0 .02" mass="1"/><site name="imu" pos=".05 0 .02" euler="{}"/>'
TURNTABLE = """<body name="table" pos="0 0 .5"><joint name="turn" axis="0 0 1"/><site name="imu" pos=".08 0 0"/>
<geom type="cylinder" size=".1 .01" contype="0" conaffinity="0"/></body>"""
G = 9.81


def riding(folder: Path, body: str = BODY.format("0 0 0"), *, moves: bool = True, **how: Any) -> Simulation:
    """Return a robot with an inertial unit; without errors unless asked for."""
    return simulated(folder, robot(folder, "", [device(InertialUnit, **{**EXACT, **how})], body=body, moves=moves))


def vectors(simulation: Simulation) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return angular velocity and specific force as measured."""
    imu = found(simulation, InertialUnit).measure()
    turn, force = imu.angular_velocity, imu.specific_force
    return (turn.x, turn.y, turn.z), (force.x, force.y, force.z)


@pytest.mark.parametrize(
    ("euler", "up"), [("0 0 0", (0.0, 0.0, G)), ("90 0 0", (0.0, G, 0.0)), ("0 90 0", (-G, 0.0, 0.0))]
)
def test_at_rest_it_measures_gravity_along_what_is_up(
    tmp_path: Path, euler: str, up: tuple[float, float, float]
) -> None:
    simulation = riding(tmp_path, BODY.format(euler))
    run(simulation, 1.0)
    turn, force = vectors(simulation)
    assert turn == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    assert force == pytest.approx(up, abs=0.02)


def test_in_free_fall_it_measures_nothing(tmp_path: Path) -> None:
    simulation = riding(tmp_path)
    found(simulation, InertialUnit).kit.data.qpos[2] = 3.0
    run(simulation, 0.2)
    assert vectors(simulation)[1] == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)


def test_on_a_turntable_it_measures_the_turning_and_the_centripetal_force(tmp_path: Path) -> None:
    simulation = riding(tmp_path, TURNTABLE, moves=False)
    found(simulation, InertialUnit).kit.data.qvel[0] = 3.0
    run(simulation, 0.1)
    turn, force = vectors(simulation)
    assert turn == pytest.approx((0.0, 0.0, 3.0), abs=1e-3)
    assert force == pytest.approx((-(3.0**2) * 0.08, 0.0, G), abs=1e-3)


def test_noise_grows_with_the_square_root_of_the_rate(tmp_path: Path) -> None:
    for rate in (0.0, 5.0):
        simulation = riding(tmp_path, TURNTABLE, moves=False, gyro_noise=0.01, force_noise=0.1, rate=rate)
        values = []
        for _ in range(400):
            run(simulation)
            turn, force = vectors(simulation)
            values.append([*turn, *force])
        deviations = np.std(values, axis=0)
        assert deviations[:3] == pytest.approx(0.01 * math.sqrt(rate or 20.0), rel=0.15)
        assert deviations[3:] == pytest.approx(0.1 * math.sqrt(rate or 20.0), rel=0.15)


def test_biases_walk_with_the_square_root_of_time(tmp_path: Path) -> None:
    ends: list[float] = []
    for seed in range(60):
        puck = robot(tmp_path, "", [device(InertialUnit, **{**EXACT, "gyro_walk": 0.1})], body=TURNTABLE)
        simulation = simulated(tmp_path, puck, seed=seed)
        run(simulation, 1.0)
        ends += vectors(simulation)[0]
    assert np.std(ends) == pytest.approx(0.1 * math.sqrt(1.0), rel=0.2)


def test_it_gives_its_orientation_only_if_it_shall(tmp_path: Path) -> None:
    turned = riding(tmp_path, BODY.format("0 0 90"), orientation=True)
    orientation = found(turned, InertialUnit).measure().orientation
    assert orientation is not None
    assert orientation.yaw == pytest.approx(math.pi / 2.0)
    assert found(riding(tmp_path), InertialUnit).measure().orientation is None


def test_failures_add_a_bias_or_noise(tmp_path: Path) -> None:
    simulation = riding(tmp_path, TURNTABLE, moves=False, gyro_noise=1e-4, gyro_bias=0.2, force_bias=1.0)
    run(simulation)
    unit = found(simulation, InertialUnit)
    right = np.array(vectors(simulation))
    unit.kit.failing = "bias"
    np.testing.assert_allclose(np.array(vectors(simulation)) - right, [[0.2] * 3, [1.0] * 3])
    unit.kit.failing = "noise"
    worse = np.array(vectors(simulation))[0]
    np.testing.assert_allclose(worse, 20.0 * right[0], atol=1e-12)


def test_another_robot_changes_nobodys_noise_and_measuring_does_not_disturb_the_physics(tmp_path: Path) -> None:
    one = robot(tmp_path, "one", [device(InertialUnit)], body=BODY.format("0 0 0"), moves=True)
    plain = robot(tmp_path, "one", body=BODY.format("0 0 0"), moves=True)
    two = robot(tmp_path, "two", [device(InertialUnit)], (1.0, 0.0, 0.0), body=TURNTABLE)
    alone, both, without = simulated(tmp_path, one), simulated(tmp_path, two, one), simulated(tmp_path, plain)
    for simulation in (alone, both, without):
        run(simulation, 0.5)
    assert alone.digest() == without.digest()
    alone_walk, walk = (simulation.robot("one").devices["device"].snapshot()["walk"] for simulation in (alone, both))
    assert alone_walk == walk != [0.0] * 6


def test_a_site_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"no site named 'nose'"):
        riding(tmp_path, site="nose")
