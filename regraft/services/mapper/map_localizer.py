"""Localization on a map that is given: the robot's place, without mapping."""

from __future__ import annotations

import numpy as np

from regraft import Component, Input, Output, Parameter, Quality, every
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.maps import OccupancyGrid
from regraft.bus_schema.messages.sensors import LaserScan, Odometry
from regraft.bus_schema.model.description import Resources
from regraft.services import robot_parameters
from regraft.services.mapper import estimates
from regraft.services.mapper.conversions import localized, map_of, planar_pose, scan_of
from regraft.services.mapper.fit_watch import FitWatch
from regraft.services.mapper.mapping import GridSettings, Mapping, Steps
from regraft.services.mapper.maps.map_files import FiledMap
from regraft.services.mapper.matching.localizer import Limits, MatchingLocalizer
from regraft.services.mapper.odometry_log import OdometryLog
from regraft.services.mapper.troubles import Troubles

SILENT = 1.0
"""s without a message until a sensor is called silent."""
REPEAT_MAP = 2.0
"""s between two publications of the map."""
MISMATCHED = 1e-6


class MapLocalizer(Component):
    """Reports where in a given map the robot is, by matching each scan with it; the map stays as it is.

    The last map holds, also when its maker rests; it is repeated on ``kept_map``. Another component may give the
    robot's start on ``start``. That is believed until scans fit the map, and whenever they no longer do. Without it,
    the odometry's frame is taken for the map's. A robot that is lost is searched for on the map.

    A pose that no scan confirms grows wrong with the odometry. ``transform_tolerance`` bounds for how long it is
    published after the last scan that was located, or after the activation. A scan that equals the one before, or that
    has nothing on the map to compare with, is not located. None is until the
    robot has moved by ``update_min_d`` or turned by ``update_min_a`` since a scan fitted. The names are those of AMCL.
    The first scan after an activation is always located.
    """

    state_version = 1
    checkpoint_every = 5.0
    resources = Resources(cpu=0.03, memory=25.0)

    resolution = Parameter(
        0.05, "side of a cell of the maps that are given", minimum=0.02, maximum=0.5, unit="m", read_only=True
    )
    largest = Parameter(40.0, "side of the largest map", minimum=1.0, maximum=200.0, unit="m", read_only=True)
    least_ratio = Parameter(
        0.6, "share of the echoes on known ground that must fit the map for a correction", minimum=0.1, maximum=1.0
    )
    largest_correction = Parameter(
        0.25, "how far one scan may move the pose without a search", minimum=0.01, maximum=1.0, unit="m"
    )
    largest_turn = Parameter(
        0.35, "how far one scan may turn the pose without a search", minimum=0.01, maximum=1.0, unit="rad"
    )
    update_min_d = Parameter(
        0.0, "how far the robot has to move until the next scan is located; 0: every scan is", minimum=0.0, unit="m"
    )
    update_min_a = Parameter(
        0.0, "how far the robot has to turn until the next scan is located; 0: every scan is", minimum=0.0, unit="rad"
    )
    transform_tolerance = Parameter(
        0.0,
        "for how long after the last scan that was located the pose is published; 0: always",
        minimum=0.0,
        maximum=3600.0,
        unit="s",
    )

    keep_surfaces = Parameter(
        False,
        "whether the map's surfaces are found once for a large part of it, not again for each place",
        read_only=True,
    )

    velocity_limit = robot_parameters.velocity_limit()
    turn_rate_limit = robot_parameters.turn_rate_limit()

    cpu = Quality("share of a core", better="lower", minimum=0.0, measured=False)
    pose_error = Quality(
        "of the pose in the map", unit="m", better="lower", minimum=0.0, functional=True, measured=False
    )
    correction = Quality("mean of the last half minute", unit="m", better="lower", minimum=0.0, estimated=False)
    inlier_ratio = Quality(
        "share of the last scan that fits the map", better="higher", minimum=0.0, maximum=1.0, estimated=False
    )

    odometry = Input(Odometry, description="pose and motion by the wheels")
    scan = Input(LaserScan, description="what is around")
    map = Input(OccupancyGrid, latest_only=True, required=False, description="the map, and later better ones")
    start = Input(Odometry, required=False, description="where in the map the robot is to begin with")
    localization = Output(Odometry, description="each odometry with the robot's pose in the map")
    kept_map = Output(
        OccupancyGrid, required=False, description="the map that holds now, for those who need it when its maker rests"
    )

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return ``cpu`` (share of a core) and ``pose_error`` (m); see `estimates`."""
        return estimates.of_localizing(float(parameters.get("resolution", cls.resolution.default)), context)

    def on_configure(self) -> None:
        """Begin without a map."""
        localizer = MatchingLocalizer(self.keep_surfaces)
        localizer.limits = self._limits()
        log = OdometryLog(self.velocity_limit, self.turn_rate_limit)
        self.mapping = Mapping(GridSettings(self.resolution, self.resolution, self.largest), localizer, log)
        self.mapping.updating = False
        self.mapping.steps = self._steps()
        self._troubles = Troubles(self.kit.diagnose)
        self._fit_watch = FitWatch(self.kit, self.mapping, self._troubles)
        self._looked_at: OccupancyGrid | None = None
        self._known_map: OccupancyGrid | None = None
        self._settled = False
        self._since = self.kit.now()
        self._scan_at: float | None = None

    def on_activate(self) -> None:
        """Sensors are silent from now on at the earliest; the robot may have been moved meanwhile."""
        self._since = self.kit.now()
        self._settled = False
        self.mapping.locate_next()
        self._fit_watch.start()

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Take over what a match must be like."""
        if hasattr(self, "mapping"):
            self.mapping.localizer.limits = self._limits()
            self.mapping.steps = self._steps()

    def _limits(self) -> Limits:
        return Limits(self.least_ratio, self.largest_correction, self.largest_turn)

    def _steps(self) -> Steps:
        return Steps(self.update_min_d, self.update_min_a)

    @odometry.handler
    def on_odometry(self, message: Odometry) -> None:
        """Publish the pose in the map."""
        pose = planar_pose(message.pose)
        jump = self.mapping.take_odometry(message.stamp, pose)
        if self._is_confirmed(message.stamp):
            self.localization.publish(localized(message, self.mapping.in_map(pose)))
        if jump:
            text = f"the odometry jumped by {jump.before.distance(jump.after):.2f} m: taken to be where it was"
            self.kit.diagnose("odometry", Level.WARNING, text)
        self._judge()

    def _is_confirmed(self, stamp: float) -> bool:
        """Return whether the last scan that was located is recent enough at a time (s)."""
        if self.transform_tolerance <= 0.0:
            late = 0.0
        else:
            located = self.mapping.located_at
            last = self._since if located is None else max(located, self._since)
            late = stamp - last if stamp - last > self.transform_tolerance + 1e-9 else 0.0
        text = f"no pose is published: no scan has been located for {late:.1f} s" if late else "the pose is published"
        self._troubles.note("transform", Level.ERROR if late else None, text, self.kit.now())
        return not late

    @scan.handler
    def on_scan(self, message: LaserScan) -> None:
        """Correct the pose; search when lost."""
        self._scan_at = self.kit.now()
        self.mapping.take_scan(scan_of(message))
        self._judge()

    def _judge(self) -> None:
        fix, located = self.mapping.fix, self.mapping.located_at
        is_new = located is not None and located >= self._since
        self._settled = self._settled or bool(is_new and fix and fix.fits and fix.match)
        self._fit_watch.look()

    @every(hz=5.0)
    def look_at_map(self) -> None:
        """Take a map that is another than the last."""
        message, known = self.map.latest, self._known_map
        if message is None or message is self._looked_at:
            return
        self._looked_at = message
        if known and _is_same(known, message):
            return
        try:
            self._take(message)
        except ValueError as error:
            self._troubles.note("map", Level.ERROR, f"the map is of no use: {error}", self.kit.now())
        else:
            self._known_map = message
            self._troubles.note("map", None, "is of use", self.kit.now())

    def _take(self, message: OccupancyGrid) -> None:
        if abs(message.origin.yaw) > MISMATCHED:
            raise ValueError("its rows must run along x, but they are turned")
        self.mapping.load(FiledMap(message.cells, message.resolution, message.origin.x, message.origin.y))

    @start.handler
    def on_start(self, message: Odometry) -> None:
        """Believe it as long as nothing better is known."""
        if not self._settled or self.mapping.localizer.lost:
            self.mapping.believe(message.stamp, planar_pose(message.pose))

    @every(seconds=REPEAT_MAP)
    def repeat_map(self) -> None:
        """Publish the map, if there is one."""
        known = (self._known_map or self._restored_map()) if self.kept_map.wanted else None
        if known is not None:
            self.kept_map.publish(known)

    def _restored_map(self) -> OccupancyGrid | None:
        """Return the map of an earlier run, None if none was restored: a grid begun here has nothing on it."""
        grid = self.mapping.grid
        return map_of(grid, self.kit.now()) if grid and grid.known_area > 0.0 else None

    @every(hz=2.0)
    def watch(self) -> None:
        """Report what is missing."""
        now = self.kit.now()
        for subject, last in (("odometry", self.mapping.newest_odometry), ("scan", self._scan_at)):
            silence = now - (self._since if last is None else max(last, self._since))
            wrong = f"silent for {silence:.1f} s" if silence > SILENT else ""
            self._troubles.note(subject, Level.ERROR if wrong else None, wrong or "is well", now)

    def evaluate(self) -> dict[str, float]:
        """Return the mean correction of the last half minute (m), and the inlier ratio."""
        ratio = self.mapping.inlier_ratio
        measured = {"inlier_ratio": ratio} if ratio is not None else {}
        return {"correction": self.mapping.drift.mean_correction} | measured

    def snapshot(self) -> PlainValue:
        """Return the map and the robot's place in it, as mappers do."""
        return self.mapping.snapshot()

    def restore(self, state: PlainValue) -> None:
        """Continue from the state of a localizer or mapper; raises ValueError as theirs do."""
        self.mapping.restore(state)


def _is_same(one: OccupancyGrid, other: OccupancyGrid) -> bool:
    alike = one.resolution == other.resolution and one.origin == other.origin
    return alike and np.array_equal(one.cells, other.cells)
