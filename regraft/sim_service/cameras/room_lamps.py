"""The lamps of a world: dimming them, and what reaches a surface of their light."""

import math

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.sim_service.cameras.vectors import dot

LAMP_FIELDS = ("light_ambient", "light_diffuse", "light_specular")
HEADLIGHT_FIELDS = ("ambient", "diffuse", "specular")

Floats = npt.NDArray[np.float64]
Brightness = npt.NDArray[np.float32]


def check_level(level: float) -> float:
    """Return a light level as a float.

    Raises:
        ValueError: it does not lie between 0 (dark) and 1 (full).
    """
    if not 0.0 <= level <= 1.0:
        raise ValueError(f"a light level lies between 0 (dark) and 1 (full), not {level}")
    return float(level)


class Lighting:
    """The lamps and the headlight of one model.

    Intensities are faded; lamps are never switched off, because OpenGL lights a scene without lamps by
    itself.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._full_lamps = {name: getattr(model, name).copy() for name in LAMP_FIELDS}
        headlight = model.vis.headlight
        self._full_headlight = {name: getattr(headlight, name).copy() for name in HEADLIGHT_FIELDS}

    def set_level(self, level: float) -> None:
        """Scale all intensities of the model to a level between 0 (dark) and 1 (full)."""
        scale = check_level(level)
        for name, full in self._full_lamps.items():
            getattr(self._model, name)[:] = full * scale
        for name, full in self._full_headlight.items():
            getattr(self._model.vis.headlight, name)[:] = full * scale


def is_directional(model: mujoco.MjModel, lamp: int) -> bool:
    """Return whether a lamp shines everywhere from one direction, as the sun does."""
    return int(model.light_type[lamp]) == int(mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)


def lamp_share(
    model: mujoco.MjModel, data: mujoco.MjData, lamp: int, points: Floats, normals: Brightness
) -> Brightness:
    """Return the share (n) of a lamp's diffuse light that reaches points (n, 3; m, world frame) without shadows.

    It depends on the angle to the surface's normal. By the MJCF's rules, distance and the angle to a spot's axis count.
    """
    direction = data.light_xdir[lamp].astype(np.float32)
    if is_directional(model, lamp):
        return np.maximum(-dot(normals, direction), 0.0)
    beams = (points - data.light_xpos[lamp]).astype(np.float32)
    distances = np.sqrt(dot(beams, beams))
    beams /= distances[:, None]
    share = np.maximum(-dot(normals, beams), 0.0)
    constant, linear, quadratic = (float(value) for value in model.light_attenuation[lamp])
    if linear or quadratic or constant != 1.0:
        share /= constant + linear * distances + quadratic * distances**2
    if int(model.light_type[lamp]) == int(mujoco.mjtLightType.mjLIGHT_SPOT):
        share *= _spot(dot(beams, direction), float(model.light_cutoff[lamp]), float(model.light_exponent[lamp]))
    return share


def _spot(cosines: Brightness, cutoff: float, exponent: float) -> Brightness:
    """Return how a spot light fades with the angle to its axis, given as a cosine (cut-off in degrees)."""
    inside = cosines >= math.cos(math.radians(cutoff))
    if exponent == 0.0:
        return inside.astype(np.float32)
    return np.where(inside, np.maximum(cosines, 0.0) ** exponent, 0.0).astype(np.float32)
