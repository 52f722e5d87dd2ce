"""A planar laser scanner."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.sim_service.layout.random_streams import generator
from regraft.sim_service.layout.scene import Scene


@dataclass(frozen=True, slots=True)
class LidarSettings:
    """A scanner at an MJCF site, turning about the site's z axis; beam 0 points along the site's x axis.

    Ranges and `noise` (standard deviation) in m. The robot does not see the body that carries the site.
    """

    site: str = "lidar"
    beams: int = 360
    range_min: float = 0.12
    range_max: float = 3.5
    noise: float = 0.01


@dataclass(frozen=True, slots=True)
class Scan:
    """One turn of the scanner, counter-clockwise from `angle_min` in steps of `angle_increment` (rad).

    `ranges` (m, one per beam) are infinite where nothing was measured between `range_min` and `range_max`.
    """

    ranges: npt.NDArray[np.float64]
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float


class Lidar:
    """Casts the beams of one scanner.

    Raises:
        SceneError: the site does not exist.
    """

    def __init__(self, scene: Scene, model: mujoco.MjModel, settings: LidarSettings) -> None:
        self.site = scene.index("site", settings.site)
        self._model = model
        self._settings = settings
        self._carrier = int(model.site_bodyid[self.site])
        angles = np.arange(settings.beams) * (2.0 * math.pi / settings.beams)
        self._fan = np.stack([np.cos(angles), np.sin(angles), np.zeros(settings.beams)], axis=1)
        self._geoms = np.empty(settings.beams, np.int32)
        self._distances = np.empty(settings.beams)

    def scan(self, data: mujoco.MjData, seed: int, step: int) -> Scan:
        """Return a scan with the noise of a seed and a step; needs up-to-date positions in `data`."""
        settings = self._settings
        beams = self._fan @ data.site_xmat[self.site].reshape(3, 3).T
        mujoco.mj_multiRay(
            self._model,
            data,
            data.site_xpos[self.site],
            beams.ravel(),
            None,
            True,
            self._carrier,
            self._geoms,
            self._distances,
            None,
            settings.beams,
            settings.range_max,
        )
        # MuJoCo's cut-off skips far geoms but does not clip ranges, and a miss is -1.
        measured = (self._distances >= settings.range_min) & (self._distances <= settings.range_max)
        ranges = self._distances.copy()
        if settings.noise > 0.0:
            ranges += settings.noise * generator(seed, f"lidar {settings.site}", step).standard_normal(settings.beams)
            np.clip(ranges, settings.range_min, settings.range_max, out=ranges)
        ranges[~measured] = np.inf
        return Scan(ranges, 0.0, 2.0 * math.pi / settings.beams, settings.range_min, settings.range_max)
