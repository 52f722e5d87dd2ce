"""The obstacles that the robot has seen around it, and those that its map lacks."""

import math
from collections.abc import Callable
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from regraft.planar import FloatArray, Pose2D, Twist2D
from regraft.services import robot_parameters as usual
from regraft.services.navigator.planning.grid_planner import NO_POINTS, GridPlanner
from regraft.services.navigator.sensing.scan import Scan, outward, thin
from regraft.services.navigator.sensing.track import Track

THINNED = 0.03  # m
# An echo nearer than this to a mapped obstacle is that obstacle: covers localisation and map errors.
EXPLAINED = 0.15
MARK = 0.05  # m, the side of the squares in which unmapped obstacles are remembered
SEEN_THROUGH = 0.10  # m: how far behind a mark an echo must be to prove the mark gone
# A beam without echo may have got lost, so a mark needs this many in a row to be gone.
LOST_BEAMS = 3
FORGET_TIMEOUT = 60.0  # s without seeing the place again
STAY_FACTOR = 10.0  # a mark is remembered so many times as long as something was there
UNSEEN_REACH = 2.0  # m around the robot in which mapped obstacles count that a scan does not look at
# Something too near to be measured is taken to be so far (m) outside of the robot. There it can still turn in place.
EDGE = 0.04
POSES_KEPT = 1.0  # s


class Sight:
    """Turns scans into obstacle points in the map's frame.

    A scan may be older than the pose that comes with it. So poses are kept for a second, and the one at the scan's
    stamp is used. Unmapped obstacles are remembered until scans look through where they were. Both follow when the
    robot's pose in the map jumps: they are kept as seen from the robot. Nothing else can be within `half_width` (m) of
    the middle of its axle.

    Something that moves leaves marks where it was, and those in its shadow are not looked through. So a mark is
    remembered for a time that grows with how long something was there: at least `least_memory`, at most 60 s.
    Something further away than `obstacle_max_range` (m) leaves none.

    A scan that does not look all around, such as a depth camera's, proves nothing elsewhere. There the remembered
    obstacles and those of the map count, so that the robot turns and backs up into neither.
    """

    def __init__(
        self,
        half_width: float = usual.OUTLINE[2],
        least_memory: float = FORGET_TIMEOUT,
        obstacle_max_range: float = math.inf,
    ) -> None:
        self._half_width, self._least_memory, self._max_range = half_width, least_memory, obstacle_max_range
        self.stamp = -math.inf
        self.obstacles: FloatArray = NO_POINTS
        """Return the points of the latest scan and known ones out of its view: (N, 2) in m, in the map."""
        self.unmapped: FloatArray = NO_POINTS
        """The remembered obstacles that the map lacks, (N, 2) in m in the map's frame."""
        self.track = Track()
        self.pose = Pose2D(0.0, 0.0, 0.0)
        """Where the robot is in the track's frame."""
        # All of these are in the track's frame. A mark's value: when it was first and last seen, and beams lost since.
        self._seen: FloatArray = NO_POINTS
        # Not looked at by the latest scan: obstacles of the map, and marks.
        self._unseen: tuple[FloatArray, FloatArray] = (NO_POINTS, NO_POINTS)
        self._poses: list[tuple[float, Pose2D]] = []
        self._marks: dict[tuple[int, int], tuple[float, float, int]] = {}

    def absorb(self, stamp: float, pose: Pose2D, twist: Twist2D, scan: Scan | None, planner: GridPlanner) -> None:
        """Take in the robot's place at `stamp` (s), its motion, and the latest scan, perhaps an old one."""
        jumps = self.track.jumps
        self.pose = self.track.follow(stamp, pose, twist)
        if self._poses and stamp < self._poses[-1][0]:
            self._poses.clear()  # the clock was set back: what was is no guide
        self._poses = [(then, where) for then, where in self._poses if stamp - POSES_KEPT <= then < stamp]
        self._poses.append((stamp, self.pose))
        if scan is not None and scan.stamp != self.stamp:
            self._look(scan, planner)
        elif jumps != self.track.jumps:
            self._place()

    def reconsider(self, planner: GridPlanner) -> None:
        """Forget the obstacles that a new map has."""
        marks = self._in_map(self._centres())
        there = _explained(marks, planner)
        self._marks = {mark: seen for (mark, seen), known in zip(self._marks.items(), there, strict=True) if not known}
        self._place()

    def forget(self, chosen: Callable[[FloatArray], NDArray[np.bool_]]) -> int:
        """Forget the remembered obstacles that are ``chosen`` by their places (N, 2) in the map; return how many."""
        there = chosen(self._in_map(self._centres()))
        kept = [mark for mark, gone in zip(self._marks.items(), there.tolist(), strict=True) if not gone]
        forgotten = len(self._marks) - len(kept)
        self._marks = dict(kept)
        mapped, marks = self._unseen
        self._unseen = (mapped, marks[~chosen(self._in_map(marks))])
        self._place()
        return forgotten

    def snapshot(self) -> dict[str, Any]:
        """Return the state as plain data."""
        unseen = [points.tolist() for points in self._unseen]
        return ({"unseen": unseen} if any(unseen) else {}) | {
            "stamp": self.stamp,
            "seen": self._seen.tolist(),
            "poses": [[then, where.x, where.y, where.yaw] for then, where in self._poses],
            "marks": [[x, y, *seen] for (x, y), seen in self._marks.items()],
            "track": self.track.snapshot(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of a snapshot."""
        self.stamp = state["stamp"]
        self._seen = np.array(state["seen"], dtype=np.float64).reshape(-1, 2)
        mapped, marks = (np.array(points, dtype=np.float64) for points in state.get("unseen", ([], [])))
        self._unseen = (mapped.reshape(-1, 2), marks.reshape(-1, 2))
        self._poses = [(then, Pose2D(x, y, yaw)) for then, x, y, yaw in state["poses"]]
        self._marks = {(x, y): (first, last, lost) for x, y, first, last, lost in state["marks"]}
        self.track.restore(state["track"])
        self.pose = self._poses[-1][1] if self._poses else self.pose
        self._place()

    def _look(self, scan: Scan, planner: GridPlanner) -> None:
        self.stamp = scan.stamp
        taken_at = self._pose_at(scan.stamp)
        self._seen = thin(outward(taken_at, scan.points()), taken_at, THINNED)
        self._clear(scan, taken_at)
        near = self._seen[np.hypot(*(self._seen - taken_at.position).T) <= self._max_range]
        new = near[~_explained(self._in_map(near), planner)]
        for x, y in np.floor(new / MARK).astype(int).tolist():
            known = self._marks.get((x, y))
            self._marks[(x, y)] = (known[0] if known else scan.stamp, scan.stamp, 0)
        self._add_near(scan, taken_at)
        self._unseen = self._not_looked_at(scan, taken_at, planner)
        self._place()

    def _add_near(self, scan: Scan, taken_at: Pose2D) -> None:
        """Add what is too near to be measured. Its place is not known, so it is taken to be at the robot's edge."""
        bearings = scan.too_near()
        if not len(bearings):
            return
        heading, edge = bearings + scan.sensor.yaw, self._half_width + EDGE
        beams = np.column_stack([np.cos(heading), np.sin(heading)])
        # How far it is from the sensor, along the beam, to a circle about the middle of the axle.
        along = beams @ np.array(scan.sensor.position)
        inside = edge**2 - math.hypot(scan.sensor.x, scan.sensor.y) ** 2
        way = np.maximum(np.sqrt(np.maximum(along**2 + inside, 0.0)) - along, 0.0)
        near = np.array(scan.sensor.position) + way[:, None] * beams
        self._seen = np.concatenate([self._seen, thin(outward(taken_at, near), taken_at, THINNED)])

    def _not_looked_at(self, scan: Scan, taken_at: Pose2D, planner: GridPlanner) -> tuple[FloatArray, FloatArray]:
        """Return the obstacles of the map near the robot, and the marks, of which the scan has no information."""
        if scan.all_around:
            return NO_POINTS, NO_POINTS
        place = self.track.correction.compose(taken_at)
        mapped = self.track.correction.inward(planner.grid.occupied_within(place.position, UNSEEN_REACH))
        return _unseen(scan, taken_at, mapped), _unseen(scan, taken_at, self._centres())

    def _place(self) -> None:
        """Bring what is remembered into the map's frame."""
        self.obstacles, self.unmapped = self._in_map(self._seen), self._in_map(self._centres())
        if any(map(len, self._unseen)):
            self.obstacles = np.concatenate([self.obstacles, *map(self._in_map, self._unseen)])

    def _in_map(self, points: FloatArray) -> FloatArray:
        return outward(self.track.correction, points) if len(points) else points

    def _centres(self) -> FloatArray:
        if not self._marks:
            return NO_POINTS
        squares = np.fromiter(chain.from_iterable(self._marks), np.float64, 2 * len(self._marks)).reshape(-1, 2)
        return (squares + 0.5) * MARK

    def _pose_at(self, stamp: float) -> Pose2D:
        earlier = self._poses[0]
        for then, where in self._poses:
            if then >= stamp:
                span = then - earlier[0]
                fraction = min(max((stamp - earlier[0]) / span, 0.0), 1.0) if span > 0.0 else 1.0
                return earlier[1].interpolate(where, fraction)
            earlier = (then, where)
        return earlier[1]

    def _clear(self, scan: Scan, taken_at: Pose2D) -> None:
        """Drop the marks that the scan looks through, those under the robot, and those long unconfirmed."""
        if not self._marks:
            return
        seen_from_base = taken_at.inward(self._centres())
        seen = scan.sensor.inward(seen_from_base)
        distance = np.hypot(seen[:, 0], seen[:, 1])
        ranges = scan.towards(seen)
        lost = np.isposinf(ranges) & (distance + SEEN_THROUGH < scan.range_max)
        gone = np.isfinite(ranges) & (ranges > distance + SEEN_THROUGH)
        gone |= np.hypot(seen_from_base[:, 0], seen_from_base[:, 1]) < self._half_width
        for (mark, (first, last, lost_before)), is_gone, is_lost in zip(
            list(self._marks.items()), gone.tolist(), lost.tolist(), strict=True
        ):
            beams = lost_before + 1 if is_lost else 0
            if is_gone or beams >= LOST_BEAMS or scan.stamp - last > self._memory(last - first):
                del self._marks[mark]
            elif beams != lost_before:
                self._marks[mark] = (first, last, beams)

    def _memory(self, stay: float) -> float:
        """Return for how long (s) a mark is remembered where something was for ``stay`` (s)."""
        return min(max(STAY_FACTOR * stay, self._least_memory), FORGET_TIMEOUT)


def _unseen(scan: Scan, taken_at: Pose2D, points: FloatArray) -> FloatArray:
    """Return those of (N, 2) points of which a scan has no information."""
    unseen: FloatArray = points[scan.towards(scan.sensor.inward(taken_at.inward(points))) == 0.0]
    return unseen


def _explained(points: FloatArray, planner: GridPlanner) -> NDArray[np.bool_]:
    """Return which points (N, 2), in the map's frame, need no mark: the map has them, or does not reach there."""
    explained: NDArray[np.bool_] = ~planner.grid.covers(points) | (planner.clearance(points) <= EXPLAINED)
    return explained
