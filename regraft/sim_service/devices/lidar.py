"""A planar laser scanner."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from regraft import Output, Parameter
from regraft.bus_schema.messages.geometry import Pose, Quaternion, Vector3
from regraft.bus_schema.messages.sensors import LaserScan
from regraft.sim_service.devices.core.failure_schedule import BIAS, DROPOUT, NOISE, ZEROS
from regraft.sim_service.devices.core.mounting import mounted_at
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter
from regraft.sim_service.layout.scene import SceneError

Ranges = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Scan:
    """One turn of the scanner, counter-clockwise from `angle_min` in steps of `angle_increment` (rad).

    `ranges` (m, one per beam) are +inf where nothing is within `range_max`. They are -inf where something is nearer
    than `range_min` (REP 117).
    """

    ranges: Ranges
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float


class Lidar(Sensor):
    """A scanner at an MJCF site, turning about the site's z axis; beam 0 points along the site's x axis.

    It does not see the body that carries the site. The defaults are those of an LDS-01, the lidar of a TurtleBot3.
    ROBOTIS' e-Manual has 360 beams, 5 Hz, and 0.12 to 3.5 m. The deviation is 0.01 m below half a metre.
    """

    measures = "scan"

    scan = Output(LaserScan, description="turns of the lidar")

    site = Parameter("lidar", "the MJCF site where it is", read_only=True)
    beams = Parameter(360, "beams of a turn", minimum=1, maximum=3600, read_only=True)
    range_min = Parameter(0.12, "shortest distance that it measures", minimum=0.0, unit="m", read_only=True)
    range_max = Parameter(3.5, "longest distance that it measures", minimum=0.01, unit="m", read_only=True)
    rate = Parameter(5.0, "turns per second", minimum=0.1, unit="Hz", read_only=True)
    noise = Parameter(0.01, "standard deviation of a range", minimum=0.0, unit="m", read_only=True)
    failure = failure_parameter(DROPOUT, BIAS, NOISE, ZEROS)
    dropout = Parameter(0.5, "share of the rays that a dropout loses", minimum=0.0, maximum=1.0)
    bias = Parameter(0.2, "what a bias adds to each range", unit="m")
    more_noise = Parameter(0.1, "standard deviation that the failure noise adds", minimum=0.0, unit="m")

    def build(self) -> None:
        """Find the site; raises SceneError, also where the lidar would measure nothing."""
        model = self.kit.model
        if self.range_min >= self.range_max:
            raise SceneError(f"range_max: {self.range_max:g} m: must be above range_min, {self.range_min:g} m")
        self.site_index = self.kit.index("site", self.site)
        self._carrier = int(model.site_bodyid[self.site_index])
        self._noise_of = f"lidar {self.site}"
        if any(isinstance(each, Lidar) and each.site == self.site for each in self.kit.siblings.values()):
            # The first lidar of a site has its noise by the site: recorded runs stay as they are.
            self._noise_of += f" {self.kit.name}"
        angles = np.arange(self.beams) * (2.0 * math.pi / self.beams)
        self._fan = np.stack([np.cos(angles), np.sin(angles), np.zeros(self.beams)], axis=1)
        self._geoms = np.empty(self.beams, np.int32)
        self._distances = np.empty(self.beams)
        position, quaternion = mounted_at(self.kit, self.site_index)
        self._pose = Pose(Vector3(*position), Quaternion(*quaternion))

    def height(self) -> float:
        """Return how high (m) it is above the floor."""
        return float(self.kit.data.site_xpos[self.site_index][2])

    def turn(self) -> Scan:
        """Return a turn now, with its noise; twice at one time gives the same noise."""
        range_min, range_max = self.range_min, self.range_max
        data, count = self.kit.data, self.beams
        beams = self._fan @ data.site_xmat[self.site_index].reshape(3, 3).T
        mujoco.mj_multiRay(
            self.kit.model,
            data,
            data.site_xpos[self.site_index],
            beams.ravel(),
            None,
            True,
            self._carrier,
            self._geoms,
            self._distances,
            None,
            count,
            range_max,
        )
        # MuJoCo's cut-off skips far geoms but does not clip ranges, and a miss is -1.
        ranges = self._distances.copy()
        nothing, near = (ranges < 0.0) | (ranges > range_max), (ranges >= 0.0) & (ranges < range_min)
        if self.noise > 0.0:
            random = self.kit.random(self._noise_of, self.kit.progress.steps)
            ranges += self.noise * random.standard_normal(count)
            np.clip(ranges, range_min, range_max, out=ranges)
        ranges[nothing], ranges[near] = np.inf, -np.inf
        return Scan(ranges, 0.0, 2.0 * math.pi / count, range_min, range_max)

    def measure(self) -> LaserScan:
        """Return a turn as a message, spoiled by what fails."""
        scan = self.turn()
        return LaserScan(
            self.kit.stamp,
            self.kit.frame("lidar"),
            self.kit.frame("base_link"),
            self._pose,
            scan.angle_min,
            scan.angle_increment,
            scan.range_min,
            scan.range_max,
            self._spoiled(scan.ranges).astype(np.float32),
        )

    def _spoiled(self, ranges: Ranges) -> Ranges:
        failing = self.kit.failing
        if failing == ZEROS:
            return np.zeros(len(ranges))
        if failing not in (DROPOUT, BIAS, NOISE):
            return ranges
        random = self.kit.random(f"{self.kit.name} {failing}", self.kit.progress.tick)
        if failing == DROPOUT:
            return np.where(random.random(len(ranges)) < self.dropout, np.inf, ranges)
        error = self.bias if failing == BIAS else self.more_noise * random.standard_normal(len(ranges))
        return np.where(np.isfinite(ranges), np.maximum(ranges + error, 0.0), ranges)
