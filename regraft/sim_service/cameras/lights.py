"""Dimming the lamps of a world."""

import mujoco

LAMP_FIELDS = ("light_ambient", "light_diffuse", "light_specular")
HEADLIGHT_FIELDS = ("ambient", "diffuse", "specular")


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
