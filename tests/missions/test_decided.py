"""FROG's rounds with the speed decided by one file, as the bandits and as the forecast take it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from regraft import Component, Output, every
from regraft.adaptation_manager.planners.bandits.bandit_planner import BanditPlanner
from regraft.adaptation_manager.planners.decisions.deciding import DecidingPlanner
from regraft.adaptation_manager.planners.forecast.forecast_planner import ForecastPlanner
from regraft.bus_schema.messages.geometry import Pose, Twist, Vector3
from regraft.bus_schema.messages.mission import MissionState
from regraft.bus_schema.messages.power import PowerDraw
from regraft.bus_schema.messages.sensors import LaserScan, Odometry
from regraft.stacks.frog.utility import driving_reward
from regraft.testing import Rig
from tests.missions.robot import STACKS
from tests.missions.test_rounds import FAR, NEAR, Rounds

pytestmark = pytest.mark.slow

DECISIONS = str(STACKS / "decisions")
PLANNERS: dict[str, type[DecidingPlanner]] = {"bandits": BanditPlanner, "forecast": ForecastPlanner}


class Sensors(Component):
    """Publishes what the decision reads: the robot drives at full speed, and something may be near."""

    odometry = Output(Odometry)
    scan = Output(LaserScan)
    power = Output(PowerDraw)

    nearest = FAR
    speed = 0.26

    @every(hz=10)
    def publish(self) -> None:
        """Publish it."""
        now = self.kit.now()
        self.odometry.publish(Odometry(now, "odom", "base_link", Pose(), Twist(Vector3(self.speed))))
        ranges = np.array([self.nearest, np.inf], dtype="<f4")
        self.scan.publish(LaserScan(now, "lidar", "base_link", Pose(), 0.0, 0.1, 0.12, 3.5, ranges))
        self.power.publish(PowerDraw(now, 10.0, {"motion": 6.63}))


@contextmanager
def decided(planner: str) -> Iterator[tuple[Rig, Rounds, DecidingPlanner, Sensors]]:
    with Rig() as rig:
        taking = rig.add(PLANNERS[planner], planner, {"decisions": DECISIONS})
        sensors = rig.add(Sensors, "world")
        yield rig, Rounds(rig, f"rounds_decided_{planner}", drives=60.0), taking, sensors


def test_the_forecast_slows_down_as_long_as_something_is_near() -> None:
    with decided("forecast") as (rig, rounds, _, sensors):
        rig.advance(3.0)
        assert rounds.speeds == []
        sensors.nearest = NEAR
        rig.advance(1.0)
        sensors.nearest = FAR
        rig.advance(1.0)
        assert [speed for _, speed in rounds.speeds] == [0.17, 0.26]


def test_the_bandits_try_every_speed_and_measure_what_each_is_worth() -> None:
    with decided("bandits") as (rig, rounds, planner, _):
        rig.advance(40.0)
        assert {speed for _, speed in rounds.speeds} == {0.1, 0.17, 0.26}
        learned = planner.snapshot()["frog/max_velocity"]["learned"]["ucb_tuned"][1]
        assert [mean for _, mean, _ in learned.values()] == [pytest.approx(driving_reward(FAR, 0.26), rel=1e-3)] * 3


def test_the_bandits_learn_that_a_speed_is_worth_nothing_where_it_is_not_safe() -> None:
    with decided("bandits") as (rig, _, planner, sensors):
        sensors.nearest = NEAR
        rig.advance(20.0)
        learned = planner.snapshot()["frog/max_velocity"]["learned"]["ucb_tuned"][1]
        assert {mean for _, mean, _ in learned.values()} == {0.0}


@pytest.mark.parametrize("planner", PLANNERS)
def test_without_sensors_the_rounds_continue(planner: str) -> None:
    with decided(planner) as (rig, rounds, _, _):
        rig.runtimes.pop("world").leave()
        rig.advance(10.0)
        assert rounds.state is MissionState.RUNNING


@pytest.mark.parametrize("planner", PLANNERS)
def test_equal_runs_decide_equally(planner: str) -> None:
    def run() -> list[object]:
        with decided(planner) as (rig, rounds, _, sensors):
            for nearest in (FAR, NEAR, FAR, NEAR):
                sensors.nearest = nearest
                rig.advance(4.0)
            return [(report.started, report.request) for report in rounds.manager.reports]

    first = run()
    assert len(first) >= 3
    assert run() == first
