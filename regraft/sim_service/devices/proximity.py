"""A ring of short-range infrared sensors."""

import math

import mujoco
import numpy as np
import numpy.typing as npt

from regraft import Output, Parameter
from regraft.bus_schema.messages.devices.ranging import Proximity
from regraft.sim_service.devices.core.failure_schedule import BIAS, DROPOUT, NOISE
from regraft.sim_service.devices.core.sensor import Sensor, failure_parameter
from regraft.sim_service.layout.scene import SceneError

Distances = npt.NDArray[np.float64]


class ProximityRing(Sensor):
    """Sensors at MJCF sites, each looking along its site's x axis; they see other robots as they see walls.

    Each takes the nearest of a few rays that are spread level over its opening angle. It does not see the body that
    carries it. The defaults are those of an e-puck: eight TCRT1000 sensors, which measure up to about 0.06 m (F.
    Mondada et al.: The e-puck, a robot designed for education in engineering, Robotica 2009). Their datasheet (Vishay
    83752) gives no opening angle in the plane. Assumptions are 0.5 rad, and a noise of 1 mm.
    """

    measures = "proximity"

    proximity = Output(Proximity, description="distances around the robot")

    sites = Parameter("ir0 ir1 ir2 ir3 ir4 ir5 ir6 ir7", "the sensors' MJCF sites, with spaces between", read_only=True)
    reach = Parameter(0.06, "longest distance that it measures", minimum=0.001, unit="m", read_only=True)
    opening = Parameter(0.5, "opening angle of a sensor", minimum=0.0, maximum=3.0, unit="rad", read_only=True)
    rays = Parameter(3, "rays of a sensor", minimum=1, maximum=100, read_only=True)
    rate = Parameter(10.0, "measurements per second", minimum=0.1, unit="Hz", read_only=True)
    noise = Parameter(0.001, "standard deviation of a distance", minimum=0.0, unit="m", read_only=True)
    failure = failure_parameter(DROPOUT, BIAS, NOISE)
    dropout = Parameter(0.5, "share of the sensors that a dropout blinds at a time", minimum=0.0, maximum=1.0)
    bias = Parameter(0.02, "what a bias adds to each distance", unit="m")
    more_noise = Parameter(0.01, "standard deviation that the failure noise adds", minimum=0.0, unit="m")

    def build(self) -> None:
        """Find the sites; raises SceneError."""
        kit = self.kit
        self._sites = [kit.index("site", name) for name in self.sites.split()]
        if not self._sites:
            raise SceneError(f"{kit.name}: the parameter 'sites' must name at least one MJCF site")
        self._carriers = [int(kit.model.site_bodyid[site]) for site in self._sites]
        angles = np.linspace(-0.5, 0.5, self.rays) * self.opening if self.rays > 1 else np.zeros(1)
        self._reach, self._rays = self.reach, self.rays
        self._fan = np.stack([np.cos(angles), np.sin(angles), np.zeros(self.rays)], axis=1)
        self._geoms, self._hits = np.empty(self.rays, np.int32), np.empty(self.rays)

    def distances(self) -> Distances:
        """Return the true distances (m) now, +inf where nothing is within reach."""
        data = self.kit.data
        return np.array(
            [
                self._nearest(place, axes.reshape(3, 3), carrier)
                for place, axes, carrier in zip(
                    data.site_xpos[self._sites], data.site_xmat[self._sites], self._carriers, strict=True
                )
            ]
        )

    def _nearest(self, place: Distances, axes: Distances, carrier: int) -> float:
        mujoco.mj_multiRay(
            self.kit.model,
            self.kit.data,
            place,
            (self._fan @ axes.T).ravel(),
            None,
            True,
            carrier,
            self._geoms,
            self._hits,
            None,
            self._rays,
            self._reach,
        )
        # MuJoCo's cut-off skips far geoms but does not clip distances, and a miss is -1.
        return min((hit for hit in self._hits.tolist() if 0.0 <= hit <= self._reach), default=math.inf)

    def measure(self) -> Proximity:
        """Return the distances with their noise, spoiled by what fails."""
        distances = self.distances()
        measured = np.isfinite(distances)
        random = self.kit.random(self.kit.name, self.kit.progress.tick)
        distances += self.noise * random.standard_normal(len(distances))
        distances = np.clip(distances + self._error(len(distances)), 0.0, self.reach)
        distances[~measured | self._blind(len(distances))] = np.inf
        return Proximity(
            self.kit.stamp,
            self.kit.frame("base_link"),
            self.reach,
            self._bearings().astype(np.float32),
            distances.astype(np.float32),
        )

    def _bearings(self) -> Distances:
        data = self.kit.data
        to_base = data.xmat[self.kit.base].reshape(3, 3).T
        axes = data.site_xmat[self._sites].reshape(-1, 3, 3)[:, :, 0] @ to_base.T
        return np.asarray(np.arctan2(axes[:, 1], axes[:, 0]))

    def _error(self, count: int) -> Distances | float:
        if self.kit.failing == NOISE:
            random = self.kit.random(f"{self.kit.name} noise", self.kit.progress.tick)
            return np.asarray(self.more_noise * random.standard_normal(count))
        return self.bias if self.kit.failing == BIAS else 0.0

    def _blind(self, count: int) -> npt.NDArray[np.bool_]:
        if self.kit.failing != DROPOUT:
            return np.zeros(count, np.bool_)
        random = self.kit.random(f"{self.kit.name} dropout", self.kit.progress.tick)
        return np.asarray(random.random(count) < self.dropout)
