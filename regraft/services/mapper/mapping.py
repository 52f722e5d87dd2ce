"""Mapping without a bus: odometry and scans in, a map and corrected poses out."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from regraft.bus_schema.annotations import PlainValue
from regraft.planar import Pose2D, wrap_angle
from regraft.services.mapper.drift import DriftWatch
from regraft.services.mapper.maps.grid import Grid
from regraft.services.mapper.maps.map_files import FiledMap
from regraft.services.mapper.maps.rays import insert
from regraft.services.mapper.maps.scan import Scan
from regraft.services.mapper.matching.localizer import Fix, Localizer
from regraft.services.mapper.matching.matcher import Match
from regraft.services.mapper.odometry_log import Jump, OdometryLog

MOVED, TURNED = 0.02, 0.02
"""m and rad since the last scan in the map from which the next one is written into it, ..."""
AT_LEAST_EVERY = 1.0
"""... and s after which it is in any case, because something else may have moved."""
RATIOS = 100
"""Matches over which the inlier ratio is averaged."""


@dataclass(frozen=True, slots=True)
class Steps:
    """How far the robot has to move (m) or turn (rad) until the next scan is located; 0: every scan is."""

    distance: float = 0.0
    angle: float = 0.0


@dataclass(frozen=True, slots=True)
class GridSettings:
    """The grid that is begun: side of a cell, side of the first square, and of the largest one (m)."""

    resolution: float = 0.05
    size: float = 8.0
    largest: float = 40.0


class Mapping:
    """Builds a map, beginning where the first odometry is, with a localizer that corrects the odometry's pose.

    Deterministic: equal calls give equal results.

    Attributes:
        localizer: estimates where the robot was at a scan.
        drift: what the localizer corrected lately.
        fits: whether everything that was seen lay within the largest grid.
        fix: the localizer's result for the last scan.
        located_at: stamp (s) of the last scan that was found to fit the map somewhere, None before the first. One that
            comes before the robot has moved by ``steps`` counts, too.
        steps: how far the robot has to move until the next scan is located.
        updating: whether scans are written into the map.
        frozen: whether the last scan repeats the one before, to the last digit, though the robot moved.
    """

    def __init__(self, settings: GridSettings, localizer: Localizer, log: OdometryLog | None = None) -> None:
        self.localizer = localizer
        self.drift = DriftWatch()
        self.fits = True
        self.fix: Fix | None = None
        self.located_at: float | None = None
        self.updating = True
        self.steps = Steps()
        self.frozen = False
        self._settings = settings
        self._grid: Grid | None = None
        # The grid's snapshot, None from each change of the grid on: it is compressed, which takes long.
        self._grid_state: PlainValue = None
        self._correction = Pose2D()
        self._odometry = log or OdometryLog()
        self._waiting: Scan | None = None
        self._last_scan: tuple[Scan, Pose2D] | None = None
        self._inserted: tuple[float, Pose2D] | None = None
        self._ratios: deque[float] = deque(maxlen=RATIOS)
        # Where the odometry was at the last scan that fitted the map; None if the robot's place has been changed since.
        self._fitted: Pose2D | None = None

    @property
    def grid(self) -> Grid | None:
        """The map, None before the first odometry."""
        return self._grid

    @property
    def newest_odometry(self) -> float | None:
        """Stamp (s) of the newest odometry, None before the first."""
        newest = self._odometry.newest
        return None if newest is None else newest[0]

    @property
    def inlier_ratio(self) -> float | None:
        """Mean share of echoes that fitted the map, None before the first match."""
        return sum(self._ratios) / len(self._ratios) if self._ratios else None

    def take_odometry(self, stamp: float, pose: Pose2D) -> Jump | None:
        """Take in an odometry (its own frame); returns the jump if it made one.

        No robot jumps: after one, the pose in the map continues from where it was.
        """
        jump = self._odometry.add(stamp, pose)
        if jump:
            self._correction = self._correction.compose(jump.before).compose(jump.after.inverse())
            self._waiting = self._fitted = None
        if self._grid is None:
            self._use(Grid(self._settings.resolution, (pose.x, pose.y), self._settings.size, self._settings.largest))
        waiting = self._waiting
        if waiting and stamp >= waiting.stamp:
            self._waiting = None
            self._take(waiting)
        return jump

    def in_map(self, pose: Pose2D) -> Pose2D:
        """Return a pose in the odometry's frame as one in the map."""
        return self._correction.compose(pose)

    def take_scan(self, scan: Scan) -> bool:
        """Take in a scan, now or when the odometry has come as far; False if its moment is no longer known."""
        newest = self.newest_odometry
        if newest is None or newest < scan.stamp:
            self._waiting = scan
            return True
        return self._take(scan)

    def _take(self, scan: Scan) -> bool:
        odometry = self._odometry.at(scan.stamp)
        if odometry is None or self._grid is None:
            return False
        if self._repeats(scan, odometry):
            return True
        if self._is_still_there(odometry):
            self.located_at = scan.stamp
            return True
        guess = self.in_map(odometry)
        fix = self.fix = self.localizer.locate(self._grid, scan, guess)
        self._fitted = odometry if fix.fits and fix.match else None
        if fix.match:
            self._ratios.append(fix.match.ratio)
        if not fix.fits:
            return True
        if fix.match:
            self.located_at = scan.stamp
            self.drift.add(scan.stamp, guess, fix.pose)
        self._correction = fix.pose.compose(odometry.inverse())
        if self.updating and self._is_news(scan.stamp, fix.pose):
            self._inserted = (scan.stamp, fix.pose)
            self.fits = insert(self._grid, fix.pose, scan)
            self._grid_state = None
        return True

    def _use(self, grid: Grid) -> None:
        self._grid, self._grid_state = grid, None

    def _repeats(self, scan: Scan, odometry: Pose2D) -> bool:
        """Return whether a scan is the same as the previous one: it has no information.

        It is wrong if the robot moved. But scans that show nothing at all are alike in every wide space.
        """
        last, self._last_scan = self._last_scan, (scan, odometry)
        if last is None or not np.array_equal(last[0].ranges, scan.ranges, equal_nan=True):
            self.frozen = False
            return False
        self._last_scan = (scan, last[1])
        moved = last[1].distance(odometry) > MOVED or abs(wrap_angle(odometry.yaw - last[1].yaw)) > TURNED
        self.frozen = moved and bool(np.isfinite(scan.ranges).any())
        return True

    def _is_still_there(self, odometry: Pose2D) -> bool:
        """Return whether the robot has hardly moved since a scan fitted the map."""
        then = self._fitted
        if then is None:
            return False
        turned = abs(wrap_angle(odometry.yaw - then.yaw))
        return then.distance(odometry) < self.steps.distance and turned < self.steps.angle

    def _is_news(self, stamp: float, pose: Pose2D) -> bool:
        if self._inserted is None:
            return True
        then, where = self._inserted
        moved = where.distance(pose) > MOVED or abs(wrap_angle(pose.yaw - where.yaw)) > TURNED
        return moved or not 0.0 <= stamp - then < AT_LEAST_EVERY - 1e-6

    def locate_next(self) -> None:
        """Locate the next scan, though the odometry may not have changed: somebody may have carried the robot."""
        self._fitted = None

    def last_scan(self) -> tuple[Scan, Pose2D] | None:
        """Return the last scan, and the odometry's pose then."""
        return self._last_scan

    def suppose(self, found: Match, odometry: Pose2D) -> None:
        """Take the robot to have been at a match when the odometry was there; the next scan shows whether it was."""
        self._correction = found.pose.compose(odometry.inverse())
        self._fitted = None
        self.drift.forget()

    def believe(self, stamp: float, pose: Pose2D) -> bool:
        """Take the robot to have been at a pose (map) at a time (s); False if its odometry is not known of then."""
        odometry = self._odometry.at(stamp)
        if odometry is None:
            return False
        self._correction = pose.compose(odometry.inverse())
        self._fitted = None
        self.drift.forget()
        return True

    def filed(self) -> FiledMap | None:
        """Return the map as it is written to a file, None before there is one."""
        grid = self._grid
        return FiledMap(grid.per_cent(), grid.resolution, grid.x, grid.y) if grid else None

    def load(self, filed: FiledMap) -> None:
        """Continue from a map out of a file; the robot is taken to be where it is in the old one.

        Raises:
            ValueError: its cells have another size, or it is too large.
        """
        wanted = self._settings.resolution
        if not math.isclose(filed.resolution, wanted, rel_tol=1e-6):
            raise ValueError(
                f"the map has cells of {filed.resolution:g} m, must be {wanted:g} m (parameter 'resolution')"
            )
        grid = Grid(wanted, (filed.x, filed.y), wanted, self._settings.largest)
        grid.fill(filed.cells, filed.x, filed.y)
        self._use(grid)
        self._inserted = self._fitted = None
        self.fits = True
        self._ratios.clear()
        self.drift.forget()
        self.localizer.forget()

    def snapshot(self) -> PlainValue:
        """Return the map, the correction and the newest odometry."""
        newest = self._odometry.newest
        correction = self._correction
        if self._grid_state is None and self._grid is not None:
            self._grid_state = self._grid.snapshot()
        return {
            "grid": self._grid_state,
            "correction": [correction.x, correction.y, correction.yaw],
            "odometry": [newest[0], newest[1].x, newest[1].y, newest[1].yaw] if newest else None,
        }

    def restore(self, state: PlainValue) -> None:
        """Continue from a snapshot of any mapping with cells of the same size.

        Raises:
            ValueError: the cells are of another size, or the map is larger than it may become. Nothing has changed.
        """
        if state["grid"] is not None:
            grid = Grid(self._settings.resolution, (0.0, 0.0), self._settings.resolution, self._settings.largest)
            grid.restore(state["grid"])
            self._use(grid)
        self._correction = Pose2D(*map(float, state["correction"]))
        self._odometry.clear()
        if state["odometry"] is not None:
            stamp, *pose = map(float, state["odometry"])
            self._odometry.add(stamp, Pose2D(*pose))
        self._waiting = self._last_scan = self._inserted = self._fitted = None
        self.localizer.forget()
