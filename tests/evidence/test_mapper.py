"""Five rooms, five minutes each, on wheels that slip: where the mappers say the robot is, and what they have mapped.

The robot is steered by the truth, so that both mappers see the same drive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from time import process_time

import numpy as np
import pytest

from regraft.evaluation.map_quality import map_quality
from regraft.planar import Pose2D, Twist2D
from regraft.services.mapper.component import MappingComponent
from regraft.services.mapper.mapper import Mapper
from regraft.services.mapper.mapping import GridSettings, Mapping
from regraft.services.mapper.maps.scan import Scan
from regraft.services.mapper.matching.localizer import Localizer, MatchingLocalizer, TrustingLocalizer
from regraft.services.mapper.odometry_mapper import OdometryMapper
from regraft.services.navigator.driving.robot import Limits
from regraft.services.navigator.follower import Follower
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.navigator.planning.grid_planner import GridPlanner
from regraft.services.navigator.sensing import scan
from regraft.sim_service import survey
from regraft.sim_service.simulation import Simulation, SimulationSettings
from tests.support.paths import ROOT
from tests.support.worlds import frog_scene, new_contacts, odometry_of, send_command, truth_of, turn_of

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(1200)]

FROG = ROOT / "regraft" / "stacks" / "frog" / "world.xml"
SEEDS = range(1, 6)
SECONDS = 300
TICKS_PER_SCAN = 4
TRAVEL_NOISE = 0.01
"""m of a wheel's travel after 1 m: the odometry alone is then off by some decimetres at the end."""
MOUNT = Pose2D(-0.064, 0.0, 0.0)


@dataclass
class Passenger:
    """A mapper on board, and how it did."""

    localizer: Localizer
    errors: list[float] = field(default_factory=list)
    costs: list[float] = field(default_factory=list)
    iou: float = 0.0

    def __post_init__(self) -> None:
        self.mapping = Mapping(GridSettings(), self.localizer)

    def ride(self, time: float, odometry: Pose2D, truth: Pose2D, seen: Scan | None) -> None:
        """Take in what the sensors say at a time (s)."""
        self.mapping.take_odometry(time, odometry)
        if seen:
            begun = process_time()
            self.mapping.take_scan(seen)
            self.costs.append(process_time() - begun)
        place = self.mapping.in_map(odometry)
        self.errors.append(math.hypot(place.x - truth.x, place.y - truth.y))


@dataclass
class Trip:
    """One seed's drive."""

    mappers: dict[type[MappingComponent], Passenger]
    distance: float = 0.0
    contacts: int = 0


def drive(seed: int) -> Trip:
    """Drive from goal to goal with both mappers on board."""
    settings = SimulationSettings()
    simulation = Simulation(frog_scene(odometry={"travel_noise": TRAVEL_NOISE}), seed, settings)
    ground = survey.ground_map(simulation)
    planner = GridPlanner(OccupancyGrid(ground.occupancy, ground.resolution, *ground.origin))
    follower = Follower(planner, Limits())
    goals = [Pose2D(goal.pose.x, goal.pose.y, goal.pose.yaw) for goal in survey.goals(simulation)]
    trip = Trip({Mapper: Passenger(MatchingLocalizer()), OdometryMapper: Passenger(TrustingLocalizer())})
    start, visits, last_scan = truth_of(simulation).pose, 0, None
    follower.start(goals[0])
    for tick in range(1, round(SECONDS / settings.tick) + 1):
        simulation.advance(settings.tick)
        truth, read, time = truth_of(simulation), odometry_of(simulation).pose, simulation.time
        seen = None
        if tick % TICKS_PER_SCAN == 0:
            ranges = turn_of(simulation).ranges.astype(np.float32).astype(np.float64)
            seen, last_scan = Scan(time, ranges, MOUNT), scan.Scan(time, ranges)
        for passenger in trip.mappers.values():
            passenger.ride(time, Pose2D(read.x, read.y, read.yaw), truth.pose, seen)
        trip.distance += abs(truth.twist.v) * settings.tick
        trip.contacts += len(new_contacts(simulation))
        pose, twist = truth.pose, truth.twist
        command = follower.update(time, Pose2D(pose.x, pose.y, pose.yaw), Twist2D(twist.v, twist.w), last_scan)
        send_command(simulation, command.v, command.w)
        if command.done or command.failed:
            visits += 1
            follower.start(goals[visits % len(goals)])
    for passenger in trip.mappers.values():
        grid = passenger.mapping.grid
        assert grid is not None
        true_map = (ground.occupancy, ground.resolution, ground.origin)
        place = (start.x, start.y)
        found = map_quality(grid.per_cent(), grid.resolution, (grid.x, grid.y), *true_map, start=place)
        passenger.iou = found.iou
    return trip


@pytest.fixture(scope="module")
def trips() -> dict[int, Trip]:
    """Drive every seed once, and print a line for each mapper."""
    made = {seed: drive(seed) for seed in SEEDS}
    for seed, trip in made.items():
        for cls, passenger in trip.mappers.items():
            errors, costs = np.array(passenger.errors), 1e3 * np.array(passenger.costs)
            print(
                f"seed {seed} {trip.distance:4.1f} m, {trip.contacts} contacts, {cls.__name__:14} error at the end "
                f"{errors[-1]:.3f}, mean {errors.mean():.3f}, worst {errors.max():.3f} m, IoU {passenger.iou:.3f}, "
                f"ms per scan {costs.mean():.2f}, 95 % within {np.percentile(costs, 95):.2f}"
            )
    return made


def test_the_place_is_known_to_a_decimetre_all_the_time(trips: dict[int, Trip]) -> None:
    for seed, trip in trips.items():
        assert max(trip.mappers[Mapper].errors) <= 0.10, seed


def test_the_map_covers_nine_tenths_of_the_room(trips: dict[int, Trip]) -> None:
    for seed, trip in trips.items():
        assert trip.mappers[Mapper].iou >= 0.9, seed


def test_the_odometry_alone_is_clearly_worse(trips: dict[int, Trip]) -> None:
    for seed, trip in trips.items():
        alone = trip.mappers[OdometryMapper]
        assert max(alone.errors) > 2.0 * 0.10, seed
        assert alone.iou < 0.7, seed


def test_the_estimates_are_of_the_right_size(trips: dict[int, Trip]) -> None:
    for cls in (Mapper, OdometryMapper):
        context = {"travel_noise": TRAVEL_NOISE, "distance": float(np.mean([t.distance for t in trips.values()]))}
        expected = cls.estimate({}, context)
        errors = float(np.mean([np.mean(trip.mappers[cls].errors) for trip in trips.values()]))
        quality = float(np.mean([trip.mappers[cls].iou for trip in trips.values()]))
        assert errors / 2.5 <= expected["pose_error"] <= errors * 2.5, cls
        assert expected["map_quality"] == pytest.approx(quality, abs=0.15), cls
