"""What the robot has seen: the obstacles around it, and those that its map lacks."""

import math
from typing import Any

import numpy as np

from services.navigator.geometry import FloatArray, Pose, interpolate, to_base_frame, to_fixed_frame
from services.navigator.planner import NO_POINTS, GridPlanner
from services.navigator.scan import Scan, thin

THINNED = 0.03  # m
# An echo nearer than this to a mapped obstacle is that obstacle: covers localisation and map errors.
EXPLAINED = 0.15
MARK = 0.05  # m, the side of the squares in which unmapped obstacles are remembered
SEEN_THROUGH = 0.10  # m: how far behind a mark an echo must be to prove the mark gone
UNDER_ROBOT = 0.15  # m from the axle's centre: nothing else can be there
FORGET_AFTER = 60.0  # s without seeing the place again
POSES_KEPT = 1.0  # s


class Sight:
    """Turns scans into obstacle points in the map's frame.

    A scan may be older than the pose that comes with it, so poses are kept for a second and the one at the
    scan's stamp is used. Unmapped obstacles are remembered until a scan looks through where they were.
    """

    def __init__(self) -> None:
        """Begin without having seen anything."""
        self.stamp = -math.inf
        self.obstacles: FloatArray = NO_POINTS
        self._poses: list[tuple[float, Pose]] = []
        self._marks: dict[tuple[int, int], float] = {}

    @property
    def unmapped(self) -> FloatArray:
        """The remembered obstacles that the map lacks, (N, 2) in m."""
        if not self._marks:
            return NO_POINTS
        return (np.array(list(self._marks), dtype=np.float64) + 0.5) * MARK

    def absorb(self, time: float, pose: Pose, scan: Scan | None, planner: GridPlanner) -> None:
        """Take in where the robot is at `time` (s) and the latest scan, which may be an old one."""
        if self._poses and time < self._poses[-1][0]:
            self._poses.clear()  # the clock was set back: what was is no guide
        self._poses = [(then, where) for then, where in self._poses if then >= time - POSES_KEPT]
        self._poses.append((time, pose))
        if scan is None or scan.stamp == self.stamp:
            return
        self.stamp = scan.stamp
        taken_at = self._pose_at(scan.stamp)
        self.obstacles = thin(to_fixed_frame(scan.points(), taken_at), taken_at, THINNED)
        self._clear(scan, taken_at)
        new = planner.grid.on_map(self.obstacles)
        new = new[planner.clearance(new) > EXPLAINED]
        for x, y in np.floor(new / MARK).astype(int).tolist():
            self._marks[(x, y)] = scan.stamp

    def forget(self) -> None:
        """Forget the obstacles that the map lacks, as a new map may have them."""
        self._marks.clear()

    def snapshot(self) -> dict[str, Any]:
        """Return the state as plain data."""
        return {
            "stamp": self.stamp,
            "obstacles": self.obstacles.tolist(),
            "poses": [[then, where.x, where.y, where.yaw] for then, where in self._poses],
            "marks": [[x, y, stamp] for (x, y), stamp in self._marks.items()],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of a snapshot."""
        self.stamp = state["stamp"]
        self.obstacles = np.array(state["obstacles"], dtype=np.float64).reshape(-1, 2)
        self._poses = [(then, Pose(x, y, yaw)) for then, x, y, yaw in state["poses"]]
        self._marks = {(x, y): stamp for x, y, stamp in state["marks"]}

    def _pose_at(self, stamp: float) -> Pose:
        earlier = self._poses[0]
        for then, where in self._poses:
            if then >= stamp:
                span = then - earlier[0]
                fraction = min(max((stamp - earlier[0]) / span, 0.0), 1.0) if span > 0.0 else 1.0
                return interpolate(earlier[1], where, fraction)
            earlier = (then, where)
        return earlier[1]

    def _clear(self, scan: Scan, taken_at: Pose) -> None:
        """Drop the marks that the scan looks through, those under the robot, and those long unconfirmed."""
        if not self._marks:
            return
        seen_from_base = to_base_frame(self.unmapped, taken_at)
        seen = to_base_frame(seen_from_base, scan.sensor)
        distance = np.hypot(seen[:, 0], seen[:, 1])
        bearing = np.arctan2(seen[:, 1], seen[:, 0]) - scan.angle_min
        beam = np.rint(np.mod(bearing, math.tau) / scan.angle_increment).astype(int)
        beam = np.where(beam * scan.angle_increment > math.tau - scan.angle_increment / 2, 0, beam)
        covered = beam < len(scan.ranges)
        ranges = np.asarray(scan.ranges)[np.where(covered, beam, 0)]
        # No echo means free up to the range; an echo too near to be true tells nothing.
        far = np.where(np.isposinf(ranges), scan.range_max, np.where(ranges >= scan.range_min, ranges, 0.0))
        gone = covered & (far > distance + SEEN_THROUGH)
        gone |= np.hypot(seen_from_base[:, 0], seen_from_base[:, 1]) < UNDER_ROBOT
        for mark, seen_through in list(zip(self._marks, gone.tolist(), strict=True)):
            if seen_through or scan.stamp - self._marks[mark] > FORGET_AFTER:
                del self._marks[mark]
