"""Both ways of control drive FROG to all its goals in real physics, and how well they do is as they estimate."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from regraft.planar import Pose2D, Twist2D
from regraft.services.navigator.driving.local_controller import Controller
from regraft.services.navigator.driving.pursuit import PursuitController
from regraft.services.navigator.driving.robot import Limits
from regraft.services.navigator.driving.rollout_controller import RolloutController
from regraft.services.navigator.follower import Follower
from regraft.services.navigator.navigator import Navigator
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.navigator.planning.grid_planner import GridPlanner
from regraft.services.navigator.pursuit_navigator import PursuitNavigator
from regraft.services.navigator.qualities import NEAR, is_safe
from regraft.services.navigator.sensing.scan import Scan
from regraft.sim_service import survey
from regraft.sim_service.people.walkers import Person, Waypoint
from regraft.sim_service.simulation import Simulation, SimulationSettings
from tests.services.rigs import FROG
from tests.support.worlds import new_contacts, odometry_of, send_command, turn_of, with_waffle

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(3600)]

SEEDS = range(1, 7)
CONTROLLERS: dict[type[Navigator], Controller] = {
    Navigator: RolloutController(),
    PursuitNavigator: PursuitController(),
}
NO_JUMP = Pose2D(0.0, 0.0, 0.0)


@dataclass
class Round:
    """One visit to all goals of a room."""

    arrived: int = 0
    contacts: int = 0
    recoveries: int = 0
    seconds: float = 0.0
    ticks: int = 0
    near: int = 0
    safe: int = 0
    costs: list[float] = field(default_factory=list)


class Driver:
    """Drives the simulated robot as the component does: 20 decisions and five scans a second."""

    def __init__(
        self, seed: int, controller: Controller, max_velocity: float, jump: float = 0.0, walk: Person | None = None
    ) -> None:
        world = FROG if walk is None else FROG.replace("world.xml", "world_with_visitor.xml")
        self.simulation = Simulation(with_waffle(Path(world)), seed, SimulationSettings(people=(walk,) if walk else ()))
        ground = survey.ground_map(self.simulation)
        planner = GridPlanner(OccupancyGrid(ground.occupancy, ground.resolution, *ground.origin))
        self.follower = Follower(planner, Limits(max_velocity=max_velocity), controller)
        self.round = Round()
        self.jump = jump
        self.noise = np.random.default_rng(seed)
        self.correction = NO_JUMP
        self.scan: Scan | None = None

    def visit_all(self) -> Round:
        """Drive to each goal in turn."""
        for goal in survey.goals(self.simulation):
            self.follower.start(Pose2D(goal.pose.x, goal.pose.y, goal.pose.yaw))
            while not self._tick():
                pass
        self.round.seconds = self.simulation.time
        self.round.contacts = len(new_contacts(self.simulation))
        return self.round

    def _tick(self) -> bool:
        simulation, visit = self.simulation, self.round
        simulation.advance(0.05)
        if visit.ticks % 4 == 0:
            seen = turn_of(simulation)
            self.scan = Scan(simulation.time, seen.ranges, seen.angle_min, seen.angle_increment)
        if self.jump and visit.ticks % 20 == 0:
            x, y, yaw = (self.jump * self.noise.uniform(-1.0, 1.0, 3)).tolist()
            self.correction = Pose2D(x, y, yaw / 2)
        reading = odometry_of(simulation)
        pose = self.correction.compose(Pose2D(reading.pose.x, reading.pose.y, reading.pose.yaw))
        twist = Twist2D(reading.twist.v, reading.twist.w)
        began = time.perf_counter()
        command = self.follower.update(simulation.time, pose, twist, self.scan)
        visit.costs.append(time.perf_counter() - began)
        send_command(simulation, command.v, command.w)
        assert not command.faults
        assert self.scan is not None
        visit.ticks += 1
        visit.near += self.scan.nearest() <= NEAR
        visit.safe += is_safe(self.scan.nearest(), abs(command.v))
        if command.done or command.failed:
            visit.arrived += command.done
            visit.recoveries += command.recoveries
        return command.done or command.failed


@pytest.mark.parametrize("kind", CONTROLLERS, ids=lambda kind: kind.__name__)
def test_all_goals_of_six_rooms_are_reached_without_contact_and_as_safely_as_estimated(kind: type[Navigator]) -> None:
    print(f"\n{kind.__name__}\nm/s  seed arrived contacts recoveries seconds ms/tick")
    for max_velocity in (0.26, 0.22, 0.18, 0.10):
        rounds = []
        for seed in SEEDS:
            visit = Driver(seed, CONTROLLERS[kind], max_velocity).visit_all()
            rounds.append(visit)
            cost = 1e3 * float(np.mean(visit.costs))
            numbers = f"{visit.arrived:7d} {visit.contacts:8d} {visit.recoveries:10d} {visit.seconds:7.1f} {cost:7.2f}"
            print(f"{max_velocity:.2f} {seed:4d} {numbers}")
        ticks = sum(visit.ticks for visit in rounds)
        safety = sum(visit.safe for visit in rounds) / ticks
        near = sum(visit.near for visit in rounds) / ticks
        estimated = kind.estimate({"max_velocity": max_velocity}, {})["safety"]
        print(f"{max_velocity:.2f}: safety {safety:.3f}, estimated {estimated:.3f}, near {near:.3f}")
        assert [visit.arrived for visit in rounds] == [4] * len(SEEDS)
        assert sum(visit.contacts for visit in rounds) == 0
        assert math.isclose(safety, estimated, abs_tol=0.04)


@pytest.mark.parametrize("kind", CONTROLLERS, ids=lambda kind: kind.__name__)
def test_pose_that_jumps_by_four_centimetres_every_second_costs_no_goal_and_no_contact(kind: type[Navigator]) -> None:
    for seed in SEEDS:
        visit = Driver(seed, CONTROLLERS[kind], 0.26, jump=0.04).visit_all()
        print(f"{kind.__name__} {seed}: {visit.arrived} arrived, {visit.contacts} contacts, {visit.seconds:.1f} s")
        assert (visit.arrived, visit.contacts) == (4, 0)


@pytest.mark.parametrize("kind", CONTROLLERS, ids=lambda kind: kind.__name__)
def test_somebody_who_walks_to_and_fro_is_never_touched_and_keeps_the_robot_from_no_goal(kind: type[Navigator]) -> None:
    places = ((1.5, -0.5), (-1.5, -0.2), (0.3, 1.6))
    walk = Person("visitor", tuple(Waypoint(x, y) for x, y in places))
    for seed in SEEDS:
        visit = Driver(seed, CONTROLLERS[kind], 0.26, walk=walk).visit_all()
        print(f"{kind.__name__} {seed}: {visit.arrived} arrived, {visit.contacts} contacts, {visit.seconds:.1f} s")
        assert (visit.arrived, visit.contacts) == (4, 0)
