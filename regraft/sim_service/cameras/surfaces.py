"""Colours of geoms and of their textures."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.sim_service.cameras.camera import Rgb
from regraft.sim_service.cameras.vectors import unrotate

Colours = npt.NDArray[np.float32]
Floats = npt.NDArray[np.float64]
DEFAULT_COLOUR = (0.5, 0.5, 0.5, 1.0)
"""The colour of a geom without one of its own, which is then its material's."""


def geom_colours(model: mujoco.MjModel) -> tuple[Colours, Colours]:
    """Return the colours (ngeom, 3) between 0 and 1 of all geoms, and likewise the light they emit."""
    colours = model.geom_rgba[:, :3].astype(np.float32)
    emitted = np.zeros_like(colours)
    for geom in range(model.ngeom):
        material = int(model.geom_matid[geom])
        if material < 0:
            continue
        if np.allclose(model.geom_rgba[geom], DEFAULT_COLOUR):
            colours[geom] = model.mat_rgba[material][:3]
        emitted[geom] = colours[geom] * model.mat_emission[material]
    return colours, emitted


def painted(colours: Colours, emitted: Colours, shining: Mapping[int, Rgb]) -> tuple[Colours, Colours]:
    """Return the colours and emitted light of all geoms, some of which shine in a colour of their own."""
    if not shining:
        return colours, emitted
    colours, emitted = colours.copy(), emitted.copy()
    for geom, rgb in shining.items():
        colours[geom] = emitted[geom] = rgb
    return colours, emitted


class PlaneTexture:
    """The picture on a floor. Textures on other geoms are not drawn."""

    def __init__(self, model: mujoco.MjModel, geom: int, texture: int) -> None:
        self.geom = geom
        width, height = int(model.tex_width[texture]), int(model.tex_height[texture])
        channels, start = int(model.tex_nchannel[texture]), int(model.tex_adr[texture])
        pixels = model.tex_data[start : start + width * height * channels].reshape(height, width, channels)
        self._pixels = pixels[:, :, :3].astype(np.float32) / 255.0
        material = int(model.geom_matid[geom])
        repeat = model.mat_texrepeat[material].copy()
        if not model.mat_texuniform[material]:
            repeat /= model.geom_size[geom][:2]
        # MuJoCo counts repetitions over half a plane's width, or over 2 m if uniform.
        self._repeat = repeat / 2.0

    def colours(self, data: mujoco.MjData, points: Floats) -> Colours:
        """Return the texture's colours (n, 3) at points (n, 3; m, world frame) on the plane."""
        local = unrotate(points - data.geom_xpos[self.geom], data.geom_xmat[self.geom])
        height, width = self._pixels.shape[:2]
        columns = np.floor(local[:, 0] * self._repeat[0] * width).astype(np.intp) % width
        rows = np.floor(-local[:, 1] * self._repeat[1] * height).astype(np.intp) % height
        return np.asarray(self._pixels[rows, columns], np.float32)


def plane_textures(model: mujoco.MjModel) -> list[PlaneTexture]:
    """Return the textures of all planes that have a flat one."""
    found: list[PlaneTexture] = []
    role: Any = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)
    for geom in range(model.ngeom):
        material = int(model.geom_matid[geom])
        is_plane = int(model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_PLANE)
        texture = int(model.mat_texid[material][role]) if material >= 0 else -1
        if is_plane and texture >= 0 and int(model.tex_type[texture]) == int(mujoco.mjtTexture.mjTEXTURE_2D):
            found.append(PlaneTexture(model, geom, texture))
    return found
