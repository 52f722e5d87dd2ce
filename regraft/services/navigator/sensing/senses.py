"""Whether the inputs about the robot and its surroundings can be true."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any, Literal

import numpy as np

from regraft.planar import FloatArray, Pose2D, Twist2D, wrap_angle
from regraft.services.navigator.planning.grid_planner import GridPlanner
from regraft.services.navigator.sensing.scan import Scan

Subject = Literal["scan", "odometry", "motion"]

SILENT_TIMEOUT = 0.6  # s without a scan, of which there are five a second
LOST_TIMEOUT = 0.5  # s without odometry, of which there are twenty a second
FEW = 0.10  # of the beams: with fewer echoes a lidar must be alone in the open, or blind
MANY = 0.30  # of the beams
EXPECTED = 0.30  # of the directions of a scan with a gap: with fewer mapped obstacles in them it may be empty
TIMES = 3.0  # as many directions with mapped obstacles as beams that come back, or more, are too many
SECTOR = math.radians(5.0)  # finer beams pass between the middles of the map's cells
CERTAIN = 0.5  # m nearer than the lidar's range: what must be seen from where the robot is
REPEATS = 3  # equal scans in a row, although the robot moved this much between the first and the last:
MOVED, TURNED = 0.04, 0.08  # m, rad

# Motion is measured by how far a point next to the axle gets, so that driving and turning add up.
ASIDE = 0.25  # m
MEMORY = 0.5  # s: what is longer ago counts less and less
ENOUGH = 0.01  # m of expected motion to judge by
HARDLY = 0.2  # of what was expected is no motion
MOSTLY = 0.5  # of what was expected is motion
PERSISTENT = 0.3  # s


@dataclass(frozen=True, slots=True)
class Fault:
    """Something is wrong with one of the senses; `text` states what."""

    subject: Subject
    text: str


class ScanFault(Enum):
    """The ways in which a lidar can be wrong."""

    SILENT = "silent"
    FROZEN = "frozen"
    BLIND = "blind"


SCAN_TEXTS = {
    ScanFault.SILENT: "no laser scan comes",
    ScanFault.FROZEN: "the laser scan stays the same although the robot moves",
    ScanFault.BLIND: "the lidar is blind: hardly any of its beams come back",
}


class ScanWatch:
    """Notices a lidar that is silent, blind, or shows the same again and again while the robot moves."""

    def __init__(self) -> None:
        self.fault: ScanFault | None = None
        self._stamp = -math.inf
        self._ranges: FloatArray = np.empty(0)
        self._repeats = 0
        self._first_at = Pose2D(0.0, 0.0, 0.0)
        self._rich_at: Pose2D | None = None
        self._content: ScanFault | None = None

    @property
    def text(self) -> str:
        """The fault in a sentence, empty if there is none."""
        return SCAN_TEXTS[self.fault] if self.fault else ""

    def is_new(self, scan: Scan | None) -> bool:
        """Return whether a scan has not been looked at yet."""
        return scan is not None and scan.stamp != self._stamp

    def look(self, pose: Pose2D, scan: Scan, place: Pose2D, planner: GridPlanner) -> None:
        """Look at a new scan.

        `pose` is the robot's in a frame that does not jump, `place` the one in the map of the `planner`.
        """
        self._stamp = scan.stamp
        frozen = self._frozen(pose, scan)
        if scan.all_around:
            self._content = frozen or self._blind(pose, scan, place, planner)
        else:
            self._content = frozen or self._blind_ahead(scan, place, planner)

    def check(self, time: float, timeout: float = SILENT_TIMEOUT) -> None:
        """Judge what has come until ``time`` (s): a lidar is silent whose last scan is older than ``timeout`` (s)."""
        silent = time - self._stamp > timeout
        self.fault = ScanFault.SILENT if silent else self._content

    def _frozen(self, pose: Pose2D, scan: Scan) -> ScanFault | None:
        if len(scan.ranges) != len(self._ranges) or not np.array_equal(scan.ranges, self._ranges, equal_nan=True):
            self._ranges, self._repeats, self._first_at = scan.ranges, 1, pose
            return None
        self._repeats += 1
        if self._content is ScanFault.FROZEN:
            return self._content
        moved = math.hypot(pose.x - self._first_at.x, pose.y - self._first_at.y) >= MOVED
        turned = abs(wrap_angle(pose.yaw - self._first_at.yaw)) >= TURNED
        still = self._repeats < REPEATS or not (moved or turned) or not np.isfinite(scan.ranges).any()
        return None if still else ScanFault.FROZEN

    def _blind(self, pose: Pose2D, scan: Scan, place: Pose2D, planner: GridPlanner) -> ScanFault | None:
        """Return whether too few beams come back, where the map or the scans before show that more should."""
        share = float(scan.echoes().mean())
        if share >= FEW:
            self._rich_at = pose if share >= MANY else self._rich_at
            return None
        before = self._rich_at
        seen_before = before is not None and math.hypot(pose.x - before.x, pose.y - before.y) < CERTAIN
        if seen_before or float(np.mean(~(scan.ranges >= scan.range_min))) >= 1.0 - FEW:
            return ScanFault.BLIND
        expected = _expected(scan, place, planner, max(scan.angle_increment, SECTOR))
        return ScanFault.BLIND if expected >= max(FEW, TIMES * share) else None

    def _blind_ahead(self, scan: Scan, place: Pose2D, planner: GridPlanner) -> ScanFault | None:
        """Return whether a scan of a part of the surroundings lacks what the map has there.

        Something that is too near to be measured is seen, too. Walls behind the robot prove nothing.
        """
        seen = scan.echoes() | np.isneginf(scan.ranges)
        if len(seen) and float(seen.mean()) >= FEW:
            return None
        if not len(seen) or float(np.mean(~(scan.ranges >= scan.range_min))) >= 1.0 - FEW:
            return ScanFault.BLIND
        return ScanFault.BLIND if _expected(scan, place, planner, scan.angle_increment) >= EXPECTED else None

    def snapshot(self) -> dict[str, Any]:
        """Return the state as plain data."""
        rich, first = self._rich_at, self._first_at
        return {
            "fault": _code(self.fault),
            "stamp": self._stamp,
            "ranges": self._ranges.tolist(),
            "repeats": self._repeats,
            "first_at": [first.x, first.y, first.yaw],
            "rich_at": None if rich is None else [rich.x, rich.y, rich.yaw],
            "content": _code(self._content),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of a snapshot."""
        self.fault, self._content = _fault(state["fault"]), _fault(state["content"])
        self._stamp = state["stamp"]
        self._ranges, self._repeats = np.array(state["ranges"], np.float64), state["repeats"]
        self._first_at = Pose2D(*state["first_at"])
        self._rich_at = None if state["rich_at"] is None else Pose2D(*state["rich_at"])


def _expected(scan: Scan, place: Pose2D, planner: GridPlanner, width: float) -> float:
    """Return in which share of a scan's directions, each of a `width` (rad), the map has something to be seen."""
    sensor = place.compose(scan.sensor)
    there = sensor.inward(planner.grid.occupied_within(sensor.position, scan.range_max - CERTAIN))
    bearings = np.mod(np.arctan2(there[:, 1], there[:, 0]) - scan.angle_min, math.tau)
    directions = np.unique(np.rint(bearings / width).astype(int))
    count = max(round(len(scan.ranges) * scan.angle_increment / width), 1)
    return float(np.count_nonzero(directions < count) / count)


def _code(fault: ScanFault | None) -> str | None:
    return fault.value if fault else None


def _fault(code: str | None) -> ScanFault | None:
    return ScanFault(code) if code else None


class MotionWatch:
    """Notices commands that move nothing, and a pose that is still while the odometry's twist moves."""

    def __init__(self) -> None:
        self.fault: Fault | None = None
        """Return the fault, until motion is seen again."""
        self._told = self._turned = self._got = 0.0
        self._doubtful = 0.0
        self._last: tuple[float, Pose2D] | None = None

    def reset(self) -> None:
        """Judge again; what is wrong stays until it is seen to be right."""
        self._told = self._turned = self._got = self._doubtful = 0.0
        self._last = None

    def check(self, stamp: float, pose: Pose2D, twist: Twist2D, told: Twist2D) -> bool:
        """Take in pose and twist at `stamp` (s) and the twist commanded since; return whether to stop now."""
        last = self._last
        if last is not None and stamp == last[0]:
            return False
        self._last = (stamp, pose)
        if last is None or not 0.0 < stamp - last[0] <= LOST_TIMEOUT:
            return False
        seconds = stamp - last[0]
        fading = max(0.0, 1.0 - seconds / MEMORY)
        got = math.hypot(pose.x - last[1].x, pose.y - last[1].y) + ASIDE * abs(wrap_angle(pose.yaw - last[1].yaw))
        self._told = fading * self._told + _travel(told, seconds)
        self._turned = fading * self._turned + _travel(twist, seconds)
        self._got = fading * self._got + got
        if self._told >= ENOUGH and min(self._got, self._turned) >= MOSTLY * self._told:
            self.fault = None
        found = self._judge()
        self._doubtful = self._doubtful + seconds if found else 0.0
        if self._doubtful < PERSISTENT:
            return False
        self.fault = found
        return True

    def _judge(self) -> Fault | None:
        if self._turned >= ENOUGH and self._got < HARDLY * self._turned:
            return Fault("odometry", "the odometry's pose stands still while its twist says that the robot moves")
        if self._told >= ENOUGH and max(self._got, self._turned) < HARDLY * self._told:
            return Fault("motion", "the robot does not move although it is told to, or its odometry does not notice")
        return None

    def snapshot(self) -> dict[str, Any]:
        """Return the state as plain data."""
        last = self._last
        return {
            "fault": None if self.fault is None else [self.fault.subject, self.fault.text],
            "sums": [self._told, self._turned, self._got, self._doubtful],
            "last": None if last is None else [last[0], last[1].x, last[1].y, last[1].yaw],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of a snapshot."""
        self.fault = None if state["fault"] is None else Fault(*state["fault"])
        self._told, self._turned, self._got, self._doubtful = state["sums"]
        last = state["last"]
        self._last = None if last is None else (last[0], Pose2D(*last[1:]))


def _travel(twist: Twist2D, seconds: float) -> float:
    return (abs(twist.v) + ASIDE * abs(twist.w)) * seconds
