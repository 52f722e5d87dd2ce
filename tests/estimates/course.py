"""A course through FROG's room in real physics, with all on board whose estimates are to come true."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from regraft.bus_schema.messages.maps import Goals, NamedGoal, OccupancyGrid
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.sensors import LaserScan, Odometry
from regraft.bus_schema.messages.world import GroundTruth
from regraft.evaluation.map_quality import map_quality
from regraft.services.battery import Battery
from regraft.services.mapper.component import MappingComponent
from regraft.services.mapper.mapper import Mapper
from regraft.services.mapper.odometry_mapper import OdometryMapper
from regraft.services.navigator.navigator import Navigator
from regraft.services.navigator.qualities import is_safe
from regraft.services.power_model import motion_power
from regraft.sim_service import survey
from regraft.sim_service.map_server import MapServer
from regraft.sim_service.world import World
from regraft.testing import Rig
from tests.services.rigs import TICK, finish, run, world_on
from tests.support.worlds import FROG_WORLD

TRAVEL_NOISE = 0.01
MAPPERS: dict[type[MappingComponent], str] = {Mapper: "matched", OdometryMapper: "trusted"}
"""Both mappers ride along, each with topics of its own."""


@dataclass
class Truth:
    """What really happened: time (s), speeds (m/s) and nearest echoes (m) of every tick, and what it took."""

    drives: int = 0
    speeds: list[float] = field(default_factory=list)
    ranges: list[float] = field(default_factory=list)
    errors: dict[str, float] = field(default_factory=dict)
    """Mean errors (m) of the pose by mapper."""
    iou: dict[str, float] = field(default_factory=dict)
    drawn: float = 0.0
    """Energy (J) that the battery has given."""
    to_limit: float | None = None
    """s until the battery was below its limit, if it was."""
    charge: tuple[float, float] = (1.0, 1.0)
    contacts: int = 0

    @property
    def seconds(self) -> float:
        """How long it took."""
        return TICK * len(self.speeds)

    @property
    def distance(self) -> float:
        """The way (m)."""
        return TICK * sum(self.speeds)

    @property
    def mean_speed(self) -> float:
        """In m/s."""
        return self.distance / self.seconds

    @property
    def motion_energy(self) -> float:
        """What the wheels took (J), by the true speed."""
        return TICK * sum(motion_power(speed) for speed in self.speeds)

    @property
    def safety(self) -> float:
        """The share of the time in which nothing was near or the robot slow."""
        return float(np.mean([is_safe(near, v) for near, v in zip(self.ranges, self.speeds, strict=True)]))

    def cruise(self) -> tuple[float, float]:
        """Return speed (m/s) and power of the wheels (W) of the fastest tenth of the time."""
        fastest = sorted(self.speeds)[-max(1, len(self.speeds) // 10) :]
        return float(np.mean(fastest)), float(np.mean([motion_power(speed) for speed in fastest]))


class Course:
    """A robot that drives from goal to goal of FROG's room."""

    def __init__(self, rig: Rig, kind: type[Navigator], max_velocity: float, **battery: float) -> None:
        self.rig, self.world = rig, world_on(rig, odometry_travel_noise=TRAVEL_NOISE)
        rig.add(MapServer, "map_server", FROG_WORLD)
        self.navigator = rig.add(kind, "navigator", {"max_velocity": max_velocity}, {"odometry": "matched/place"})
        for cls, name in MAPPERS.items():
            rig.add(cls, name, connections={"map": f"{name}/map", "localization": f"{name}/place"})
        self.battery = rig.add(Battery, parameters=battery)
        self.goals = rig.collect("goals", Goals)
        self._truth, self._scans = rig.collect("ground_truth", GroundTruth), rig.collect("scan", LaserScan)
        self._places = {name: rig.collect(f"{name}/place", Odometry) for name in MAPPERS.values()}
        self._maps = {name: rig.collect(f"{name}/map", OccupancyGrid) for name in MAPPERS.values()}
        self._states = rig.collect("battery", BatteryState)
        run(rig, self.world, 2.1)

    def drive(self) -> Truth:
        """Drive to each goal in turn; returns what really happened."""
        goals = self.goals[-1].goals
        done, begun = Truth(len(goals)), len(self._truth)
        start, drawn = self.rig.clock.now() / 1e9, self.battery.evaluate()["drawn"]
        first = self._states[-1].charge
        for named in goals:
            self._visit(named)
        truth = self._truth[begun:]
        done.speeds = [abs(told.twist.forward) for told in truth]
        stamps = [scan.stamp for scan in self._scans]
        nearest = [float(np.min(scan.ranges)) for scan in self._scans]
        done.ranges = [nearest[int(np.searchsorted(stamps, told.stamp, "right")) - 1] for told in truth]
        done.drawn, done.contacts = self.battery.evaluate()["drawn"] - drawn, truth[-1].contacts
        below = [event.stamp - start for event in self.rig.events if event.kind == "battery.below_limit"]
        done.to_limit, done.charge = (below[0] if below else None), (first, self._states[-1].charge)
        for name, places in self._places.items():
            done.errors[name] = float(np.mean([_apart(*pair) for pair in zip(places, self._truth, strict=False)]))
            done.iou[name] = self._iou(self.world, self._maps[name][-1])
        return done

    def _visit(self, named: NamedGoal) -> None:
        goal = self.rig.goal("navigate_to", NavigateTo(named.pose), Arrival, NavigationProgress)
        finish(self.rig, self.world, goal)
        assert goal.result is not None, goal.error
        assert goal.result.arrived, goal.result.reason

    def _iou(self, world: World, made: OccupancyGrid) -> float:
        ground, pose = survey.ground_map(world.simulation), self._truth[0].pose
        truth = (ground.occupancy, ground.resolution, ground.origin)
        origin = (made.origin.x, made.origin.y)
        return map_quality(made.cells, made.resolution, origin, *truth, start=(pose.x, pose.y)).iou


def _apart(place: Odometry, truth: GroundTruth) -> float:
    assert abs(place.stamp - truth.stamp) < 1e-6
    return math.hypot(place.pose.x - truth.pose.x, place.pose.y - truth.pose.y)
