"""A server's knowledge: the map, where the robot is, and what stands around it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from regraft import RefusalCode, RequestRefused
from regraft.bus_schema.messages import maps, sensors
from regraft.bus_schema.messages.nav2.paths import ClearCostmap
from regraft.planar import FloatArray, Pose2D, Twist2D
from regraft.services.navigator.conversions import grid_of, planar_pose, planar_twist, same_map, scan_of
from regraft.services.navigator.planning.grid_planner import GridPlanner
from regraft.services.navigator.planning.terrain import Inflation
from regraft.services.navigator.sensing.scan import Scan
from regraft.services.navigator.sensing.senses import LOST_TIMEOUT, ScanWatch
from regraft.services.navigator.sensing.sight import FORGET_TIMEOUT, Sight

FRAMES = ("map", "odom")
"""The frames of goals and paths; the odometry's is that of the map."""


class Area(Enum):
    """Where obstacles are forgotten; the squares lie along the map's axes."""

    EVERYWHERE = "everywhere"
    OUTSIDE = "outside of a square around the robot"
    AROUND_ROBOT = "in a square around the robot"
    AROUND_POSE = "in a square around a pose"


class BadMap(ValueError):
    """A map that nothing can be planned on; the text states why."""


def frame_problem(frame: str) -> str:
    """Return what is wrong with a frame, empty if it is known."""
    return "" if frame in FRAMES else f"the frame must be {' or '.join(FRAMES)}, is {frame!r}"


def check_frame(place: str, frame: str) -> None:
    """Make sure that a pose or path is in a known frame; raises ValueError."""
    if problem := frame_problem(frame):
        raise ValueError(f"{place}: {problem}")


@dataclass(slots=True)
class Surroundings:
    """Map, pose and obstacles, from the latest messages.

    ``half_width`` (m) is how far the robot reaches to each side; `inflation` how far its paths keep away. Obstacles are
    remembered for ``least_memory`` (s) at least, those within ``obstacle_max_range`` (m).
    """

    inflation: Inflation
    half_width: float
    least_memory: float = FORGET_TIMEOUT
    obstacle_max_range: float = math.inf
    pose: Pose2D = field(default_factory=Pose2D)
    twist: Twist2D = field(default_factory=Twist2D)
    stamp: float = -math.inf
    """When (s) the robot was at ``pose``; minus infinity before the first odometry."""
    sight: Sight = field(init=False)
    _planner: GridPlanner | None = field(init=False, default=None)
    _scans: ScanWatch = field(init=False, default_factory=ScanWatch)
    _map: maps.OccupancyGrid | None = field(init=False, default=None)
    _scan: tuple[sensors.LaserScan, Scan] | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self.sight = Sight(self.half_width, self.least_memory, self.obstacle_max_range)

    @property
    def planner(self) -> GridPlanner:
        """The planner on the map; raises LookupError before the first map."""
        if self._planner is None:
            raise LookupError("no usable map has come")
        return self._planner

    def missing(self) -> str:
        """Return what has not come yet, as words; empty if there is a pose and a map."""
        missing = []
        if self.stamp == -math.inf:
            missing.append("no odometry has come")
        if self._planner is None:
            missing.append("no usable map has come")
        return " and ".join(missing)

    def fault(self, now: float) -> str:
        """Return why the robot must not drive at ``now`` (s), by what the last `look` has shown."""
        return "no odometry comes" if now - self.stamp > LOST_TIMEOUT else self._scans.text

    def use_map(self, message: maps.OccupancyGrid | None) -> None:
        """Take a map where it is new; raises BadMap once for each that is of no use."""
        if message is None or message is self._map:
            return
        known, self._map = self._map, message
        if known is not None and same_map(message, known):
            return
        try:
            planner = GridPlanner(grid_of(message), self.inflation)
        except ValueError as error:
            raise BadMap(f"the map is of no use: {error}") from error
        self._planner = planner
        self.sight.reconsider(planner)

    def look(
        self, odometry: sensors.Odometry | None, scan: sensors.LaserScan | None, now: float, scan_timeout: float
    ) -> None:
        """Take in what the senses have sent until ``now`` (s); a scan older than ``scan_timeout`` (s) is no help."""
        if odometry is None or self._planner is None:
            return
        self.pose, self.twist, self.stamp = planar_pose(odometry.pose), planar_twist(odometry.twist), odometry.stamp
        seen = self._converted(scan)
        if seen is not None and self._scans.is_new(seen):
            self._scans.look(self.sight.pose, seen, self.pose, self._planner)
        self._scans.check(now, scan_timeout)
        self.sight.absorb(self.stamp, self.pose, self.twist, None if self._scans.text else seen, self._planner)

    def room(self) -> float:
        """Return how far (m) the nearest obstacle is from the middle of the axle; inf where none is known.

        It may be in the latest scan, remembered, or on the map.
        """
        nearest = math.inf
        for points in (self.sight.obstacles, self.sight.unmapped):
            if len(points):
                nearest = min(nearest, float(np.hypot(*(points - self.pose.position).T).min()))
        if self._planner is not None:
            nearest = min(nearest, float(self._planner.clearance(np.array([self.pose.position]))[0]))
        return nearest

    def forget(self, request: ClearCostmap, area: Area) -> int:
        """Forget remembered obstacles; returns how many marks. Raises RequestRefused for a request of another area."""
        return self.sight.forget(_cleared_by(request, area, self.pose))

    def _converted(self, message: sensors.LaserScan | None) -> Scan | None:
        if message is None:
            return None
        if self._scan is None or self._scan[0] is not message:
            self._scan = (message, scan_of(message))
        return self._scan[1]


def _cleared_by(request: ClearCostmap, area: Area, robot: Pose2D) -> Callable[[FloatArray], NDArray[np.bool_]]:
    """Return which places (N, 2) a request clears; raises RequestRefused."""
    _check_clearing(request, area)
    centre = robot.position if request.around is None else planar_pose(request.around.pose).position
    half = request.reset_distance / 2

    def chosen(places: FloatArray) -> NDArray[np.bool_]:
        if area is Area.EVERYWHERE:
            return np.ones(len(places), bool)
        within: NDArray[np.bool_] = np.abs(places - centre).max(axis=1, initial=0.0) <= half
        return ~within if area is Area.OUTSIDE else within

    return chosen


def _check_clearing(request: ClearCostmap, area: Area) -> None:
    """Make sure that a request is one of that area; raises RequestRefused."""
    if area is Area.EVERYWHERE and request.reset_distance != 0.0:
        why = f"must be 0, is {request.reset_distance:g}: this service clears everything"
        raise RequestRefused(why, RefusalCode.INVALID, field="reset_distance")
    if (request.around is not None) is not (area is Area.AROUND_POSE):
        why = "must be a pose" if request.around is None else f"must be left out: this service clears {area.value}"
        raise RequestRefused(why, RefusalCode.INVALID, field="around")
    if request.around is not None and (problem := frame_problem(request.around.frame)):
        raise RequestRefused(problem, RefusalCode.INVALID, field="around")
