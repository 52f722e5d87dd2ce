"""The base of all mappers as components: ports, services, state."""

from __future__ import annotations

import math
from abc import abstractmethod
from pathlib import Path

import numpy as np

from regraft import Component, Input, Output, Parameter, Quality, RefusalCode, RequestRefused, every, service
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.maps import LoadMap, MapFile, OccupancyGrid, SaveMap
from regraft.bus_schema.messages.sensors import LaserScan, Odometry
from regraft.services import robot_parameters
from regraft.services.mapper.conversions import localized, map_of, planar_pose, scan_of
from regraft.services.mapper.mapping import GridSettings, Mapping
from regraft.services.mapper.maps import map_files
from regraft.services.mapper.maps.grid import Cells
from regraft.services.mapper.matching.localizer import Localizer
from regraft.services.mapper.odometry_log import Jump, OdometryLog
from regraft.services.mapper.troubles import Troubles

SILENT = 1.0
"""s without a message until a sensor is called silent."""
REPEAT_MAP = 3.0
"""s after which the map is published though nothing changed, for those who have come since."""


class MappingComponent(Component):
    """Publishes a map of what the lidar sees, and the robot's place in it.

    The ``map`` frame is where the odometry's frame is at the start. Subclasses implement how the odometry is corrected.
    """

    state_version = 1
    checkpoint_every = 5.0

    resolution = Parameter(0.05, "side of a map cell", minimum=0.02, maximum=0.5, unit="m", read_only=True)
    size = Parameter(
        8.0, "side of the square around the start that the map begins with", minimum=1.0, unit="m", read_only=True
    )
    largest = Parameter(40.0, "side of the largest map", minimum=1.0, maximum=200.0, unit="m", read_only=True)
    map_rate = Parameter(1.0, "how often a changed map is published", minimum=0.0, maximum=10.0, unit="Hz")
    update_map = Parameter(True, "whether scans are written into the map; without, it serves to find one's place alone")
    folder = Parameter("", "where map files are that are not named from the root", unit="path")

    velocity_limit = robot_parameters.velocity_limit()
    turn_rate_limit = robot_parameters.turn_rate_limit()
    wheel_separation = robot_parameters.wheel_separation()

    cpu = Quality("share of a core", better="lower", minimum=0.0, measured=False)
    pose_error = Quality(
        "of the pose in the map", unit="m", better="lower", minimum=0.0, functional=True, measured=False
    )
    map_quality = Quality(
        "likeness of the map to what is", better="higher", minimum=0.0, maximum=1.0, functional=True, measured=False
    )
    known_area = Quality("on the map", unit="m2", better="higher", minimum=0.0, functional=True, estimated=False)

    odometry = Input(Odometry, description="pose and motion by the wheels")
    scan = Input(LaserScan, description="what is around")
    map = Output(OccupancyGrid, description="the map, while it changes")
    localization = Output(Odometry, description="each odometry with the robot's pose in the map")

    @abstractmethod
    def localizer(self) -> Localizer:
        """Return what corrects the odometry."""

    def on_configure(self) -> None:
        """Begin without a map."""
        log = OdometryLog(self.velocity_limit, self.turn_rate_limit)
        self.mapping = Mapping(GridSettings(self.resolution, self.size, self.largest), self.localizer(), log)
        self.troubles = Troubles(self.kit.diagnose)
        self._published: tuple[float, float, float, Cells] | None = None
        self._map_at = -math.inf
        self._since = self.kit.now()
        self._scan_at: float | None = None
        self._late = False

    def on_activate(self) -> None:
        """Sensors count as silent from now at the earliest; subscribers get the map again."""
        self._since = self.kit.now()
        self._published = None

    @odometry.handler
    def on_odometry(self, message: Odometry) -> None:
        """Publish the pose in the map."""
        pose = planar_pose(message.pose)
        jump = self.mapping.take_odometry(message.stamp, pose)
        self.localization.publish(localized(message, self.mapping.in_map(pose)))
        if jump:
            self._tell_jump(jump)

    @scan.handler
    def on_scan(self, message: LaserScan) -> None:
        """Write a scan into the map."""
        self._scan_at = self.kit.now()
        self.mapping.updating = self.update_map
        self._late = not self.mapping.take_scan(scan_of(message))

    def _tell_jump(self, jump: Jump) -> None:
        distance = jump.before.distance(jump.after)
        text = f"the odometry jumped by {distance:.2f} m: the robot is taken to be where it was"
        self.kit.diagnose("odometry", Level.WARNING, text, distance=distance)
        self.kit.event("mapper.odometry_jump", text, distance=distance)

    @every(hz=2.0)
    def watch(self) -> None:
        """Return whether the sensors are silent, a scan repeats, or the map has become too large."""
        now = self.kit.now()
        silence = self._silence(self.mapping.newest_odometry)
        wrong = f"silent for {silence:.1f} s" if silence > SILENT else ""
        self.troubles.note("odometry", Level.ERROR if wrong else None, wrong or "is well", now)
        wrong = self._wrong_with_scans()
        self.troubles.note("scan", Level.ERROR if wrong else None, wrong or "is well", now)
        text = f"what lies beyond {self.largest:g} m is left out (parameter 'largest')"
        self.troubles.note("map", None if self.mapping.fits else Level.WARNING, text, now)

    def _silence(self, last: float | None) -> float:
        """Return for how long (s) a sensor has been silent that was last heard at a time (s)."""
        return self.kit.now() - (self._since if last is None else max(last, self._since))

    def _wrong_with_scans(self) -> str:
        silence = self._silence(self._scan_at)
        if silence > SILENT:
            return f"silent for {silence:.1f} s"
        if self.mapping.frozen:
            return "repeats itself though the robot moves"
        return "comes too late: the odometry of its time is forgotten" if self._late else ""

    @every(hz=map_rate)
    def publish_map(self) -> None:
        """Publish the map if it has changed, or has not been published for some time."""
        grid, now = self.mapping.grid, self.kit.now()
        if grid is None:
            return
        last = self._published
        same = last and last[:3] == (grid.resolution, grid.x, grid.y) and np.array_equal(last[3], grid.cells)
        if same and now - self._map_at < REPEAT_MAP:
            return
        self._published = (grid.resolution, grid.x, grid.y, grid.cells.copy())
        self._map_at = now
        self.map.publish(map_of(grid, now))

    @service("save_map")
    def save_map(self, request: SaveMap) -> MapFile:
        """Write the map to a PNG and a YAML file; refused if there is no map or it cannot be written."""
        filed = self.mapping.filed()
        if filed is None:
            raise RequestRefused("there is no map to save: no odometry has come", RefusalCode.UNAVAILABLE)
        try:
            path = self._path(request.file)
            map_files.save(path, filed)
        except map_files.BadMapFile as error:
            raise RequestRefused(str(error), RefusalCode.INVALID, field="file") from None
        return self._map_file(path)

    @service("load_map")
    def load_map(self, request: LoadMap) -> MapFile:
        """Continue from a map out of a file; refused, with nothing changed, if it is of no use."""
        try:
            path = self._path(request.file)
            self.mapping.load(map_files.load(path))
        except ValueError as error:
            raise RequestRefused(str(error), RefusalCode.INVALID, field="file") from None
        self._published = None
        return self._map_file(path)

    def _path(self, name: str) -> Path:
        return Path(self.folder) / map_files.yaml_path(name)

    def _map_file(self, path: Path) -> MapFile:
        grid = self.mapping.grid
        return MapFile(str(path), grid.known_area if grid else 0.0)

    def evaluate(self) -> dict[str, float]:
        """Return the ground that is known (m²)."""
        grid = self.mapping.grid
        return {"known_area": grid.known_area if grid else 0.0}

    def snapshot(self) -> PlainValue:
        """Return the map and the robot's place in it; any mapper can continue from it."""
        return self.mapping.snapshot()

    def restore(self, state: PlainValue) -> None:
        """Continue from another mapper's state; raises ValueError if its cells or its map do not fit."""
        self.mapping.restore(state)
