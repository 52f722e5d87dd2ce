"""Drives of the simulated robot, recorded once for any number of mappers and localizers."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from regraft.planar import Pose2D, Twist2D, wrap_angle
from regraft.services.mapper.mapping import Mapping
from regraft.services.mapper.maps.map_files import FiledMap
from regraft.services.mapper.maps.scan import Scan
from regraft.services.navigator.driving.robot import Limits
from regraft.services.navigator.follower import Follower
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.navigator.planning.grid_planner import GridPlanner
from regraft.services.navigator.sensing import scan
from regraft.sim_service import survey
from regraft.sim_service.layout.scene import load_scene
from regraft.sim_service.robots import Place
from regraft.sim_service.simulation import Simulation, SimulationSettings
from tests.support.worlds import frog_scene, odometry_of, send_command, truth_of, turn_of, waffle

from .room import MOUNT, TICK, TICKS_PER_SCAN

TRAVEL_NOISE = 0.01
"""m of a wheel's travel after 1 m, as in FROG's explore.yaml."""
SPEED = 0.22
"""m/s in the corridor."""
WAY = 32.0
"""m that are driven in the corridor, from as far before its middle as behind it."""
IN_SIGHT, OUT_OF_SIGHT = 34.0, 39.6
"""Lengths (m) of corridors whose ends a lidar of 3.5 m sees at first and last, and never."""
CORRIDOR = """<mujoco><compiler angle="radian"/><worldbody><geom type="plane" size="30 30 .1"/>
<body euler="0 0 {heading}">
  <geom type="box" size="{half} .05 .3" pos="0 1.05 .3"/><geom type="box" size="{half} .05 .3" pos="0 -1.05 .3"/>
  <geom type="box" size=".05 1.1 .3" pos="{end} 0 .3"/><geom type="box" size=".05 1.1 .3" pos="-{end} 0 .3"/>
</body></worldbody></mujoco>"""


@dataclass(frozen=True, slots=True)
class Moment:
    """A tick: its time (s), where the odometry puts the robot, where it is, and the ranges (m) of a scan, if any."""

    time: float
    odometry: Pose2D
    truth: Pose2D
    ranges: NDArray[np.float32] | None

    def ride(self, mapping: Mapping) -> Pose2D:
        """Have a mapping take in what the sensors say; returns where it takes the robot to be."""
        mapping.take_odometry(self.time, self.odometry)
        if self.ranges is not None:
            mapping.take_scan(Scan(self.time, self.ranges.astype(np.float64), MOUNT))
        return mapping.in_map(self.odometry)


@dataclass(frozen=True, slots=True)
class Drive:
    """A recorded drive, and the true map of where it led."""

    ground: FiledMap
    moments: tuple[Moment, ...]

    @property
    def distance(self) -> float:
        """Its length (m)."""
        places = [moment.truth for moment in self.moments]
        return sum(one.distance(other) for one, other in itertools.pairwise(places))


def through_frog(seed: int, seconds: float = 300.0) -> Drive:
    """Drive from goal to goal of FROG's room, steered by the truth."""
    simulation = Simulation(frog_scene(odometry={"travel_noise": TRAVEL_NOISE}), seed, SimulationSettings())
    ground = _ground(simulation)
    planner = GridPlanner(OccupancyGrid(ground.cells, ground.resolution, ground.x, ground.y))
    follower = Follower(planner, Limits())
    goals = [Pose2D(goal.pose.x, goal.pose.y, goal.pose.yaw) for goal in survey.goals(simulation)]
    moments, visits, seen = [], 0, None
    follower.start(goals[0])
    for moment in _moments(simulation):
        moments.append(moment)
        if moment.time >= seconds - TICK / 2.0:
            break
        if moment.ranges is not None:
            seen = scan.Scan(moment.time, moment.ranges.astype(np.float64))
        twist = truth_of(simulation).twist
        command = follower.update(moment.time, moment.truth, Twist2D(twist.v, twist.w), seen)
        send_command(simulation, command.v, command.w)
        if command.done or command.failed:
            visits += 1
            follower.start(goals[visits % len(goals)])
    return Drive(ground, tuple(moments))


def down_corridor(seed: int, length: float = OUT_OF_SIGHT, heading: float = 0.0, **odometry: float) -> Drive:
    """Drive along the middle of a bare corridor of 2 m, steered by the truth; ``heading`` (rad) is where it leads."""
    cos, sin = math.cos(heading), math.sin(heading)
    place = Place(x=-WAY / 2.0 * cos, y=-WAY / 2.0 * sin, yaw=heading)
    robot = waffle(place=place, devices={"odometry": {"travel_noise": TRAVEL_NOISE, **odometry}})
    with TemporaryDirectory() as folder:
        world = Path(folder) / "corridor.xml"
        world.write_text(CORRIDOR.format(heading=heading, half=length / 2.0 + 0.1, end=length / 2.0 + 0.05))
        simulation = Simulation(load_scene(world, (robot,)), seed, SimulationSettings())
    moments = []
    for moment in _moments(simulation):
        moments.append(moment)
        truth = moment.truth
        if cos * truth.x + sin * truth.y >= WAY / 2.0:
            break
        aside, turned = cos * truth.y - sin * truth.x, wrap_angle(truth.yaw - heading)
        send_command(simulation, SPEED, -aside - 2.0 * turned)
    return Drive(_ground(simulation), tuple(moments))


def _ground(simulation: Simulation) -> FiledMap:
    ground = survey.ground_map(simulation)
    return FiledMap(ground.occupancy, ground.resolution, *ground.origin)


def _moments(simulation: Simulation) -> Iterator[Moment]:
    ticks = 0
    while True:
        simulation.advance(TICK)
        ticks += 1
        ranges = turn_of(simulation).ranges.astype(np.float32) if ticks % TICKS_PER_SCAN == 0 else None
        truth = truth_of(simulation).pose
        yield Moment(simulation.time, odometry_of(simulation).pose, Pose2D(truth.x, truth.y, truth.yaw), ranges)
