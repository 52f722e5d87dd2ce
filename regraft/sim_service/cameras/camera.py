"""The base of all cameras."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Protocol

import cv2
import numpy as np
import numpy.typing as npt

from regraft.sim_service.layout.random_streams import generator
from regraft.sim_service.layout.scene import Scene

NOISE_STOCK = 2**20
"""How many different stretches of noise a camera has."""

Image = npt.NDArray[np.uint8]
"""A picture (height, width, 3) of RGB values, row 0 at the top."""

Depths = npt.NDArray[np.float32]
"""Depths (height, width) in m along the optical axis, row 0 at the top; +inf where nothing is."""

Rgb = tuple[float, float, float]
"""Red, green and blue between 0 and 1."""


@dataclass(frozen=True, slots=True)
class RenderState:
    """A moment of a world: besides the world file and the placement, all that a camera needs anywhere.

    `qpos` are MuJoCo's generalised positions (float64). `light` is the level of the lamps between 0 and 1. `step` is
    the number of physics steps, which seeds the sensor's noise. `colours` are those of geoms that shine, by the geoms'
    numbers; all others look as in the world file.
    """

    qpos: npt.NDArray[np.float64]
    light: float
    step: int
    colours: Mapping[int, Rgb] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """Noise of an image sensor with fixed exposure, in electrons.

    White (255) fills a pixel with `full_well` electrons; photon noise is the square root of the electrons
    collected; `read` is the standard deviation added when reading out.
    """

    full_well: float = 600.0
    read: float = 4.0


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """Which camera of the world to render, and how.

    `width` and `height` (pixels) default to the camera's resolution in the MJCF. With `always_lit` the camera
    sees full light at any level of the lamps.
    """

    name: str
    width: int | None = None
    height: int | None = None
    always_lit: bool = False
    noise: SensorNoise | None = None
    seed: int = 0


class Camera(Protocol):
    """Renders pictures of one camera. Use it in the thread that made it."""

    def render(self, state: RenderState) -> Image:
        """Return the picture of a moment."""

    def depths(self, state: RenderState) -> Depths:
        """Return the depths of a moment."""

    def close(self) -> None:
        """Give back what the renderer holds; the camera is of no use afterwards."""


def image_size(scene: Scene, settings: CameraSettings) -> tuple[int, int]:
    """Return width and height in pixels.

    Raises:
        SceneError: the world has no such camera.
        ValueError: a size is not positive.
    """
    resolution = scene.model.cam_resolution[scene.index("camera", settings.name)]
    width = int(resolution[0]) if settings.width is None else settings.width
    height = int(resolution[1]) if settings.height is None else settings.height
    if width < 1 or height < 1:
        raise ValueError(f"camera {settings.name!r} needs a positive size, not {width} x {height}")
    return width, height


def expose(image: Image, settings: CameraSettings, step: int) -> Image:
    """Return the picture as the sensor delivers it at a physics step: with its noise, if it has any.

    The noise of the photons is taken as normal. That differs from Poisson's only below a few electrons, where the noise
    of reading out is larger.
    """
    noise = settings.noise
    if noise is None:
        return image
    electrons = np.arange(256) / 255.0 * noise.full_well
    deviation_of_value = (np.sqrt(electrons + noise.read**2) * (255.0 / noise.full_well)).astype(np.float32)
    random = generator(settings.seed, f"camera {settings.name}", step)
    first = int(random.integers(NOISE_STOCK))
    stretch = _normal_numbers(settings.seed, settings.name, image.size)[first : first + image.size]
    deviations = np.asarray(cv2.LUT(image, deviation_of_value) * stretch.reshape(image.shape))
    return np.asarray(cv2.add(image, deviations, dtype=cv2.CV_8U), np.uint8)


@cache
def _normal_numbers(seed: int, camera: str, largest: int) -> npt.NDArray[np.float32]:
    """Return a stock of standard normal numbers, from which every picture takes a stretch of its own.

    Drawing as many for every picture would take as long as rendering it.
    """
    random = generator(seed, f"noise of camera {camera}")
    return random.standard_normal(NOISE_STOCK + largest, np.float32)
