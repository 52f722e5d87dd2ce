"""A camera that needs no OpenGL: one ray per pixel, shaded with numpy.

It draws shapes, colours, floor textures and lamps as the OpenGL renderer does with shadows off. It hides geoms of
the same groups. It draws the shadows of the first lamp if asked to. It knows no specular highlights, reflections,
transparency or sky.
"""

import math
from collections.abc import Mapping

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.sim_service.cameras.camera import CameraSettings, Depths, Image, RenderState, Rgb, expose, image_size
from regraft.sim_service.cameras.room_lamps import Brightness, Floats, Lighting, is_directional, lamp_share
from regraft.sim_service.cameras.surfaces import geom_colours, painted, plane_textures
from regraft.sim_service.cameras.vectors import dot, rotate
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import Scene

NO_BODY = -1
SHOWN_GROUPS = np.array(mujoco.MjvOption().geomgroup, np.uint8)
"""Which groups of geoms OpenGL shows: 0 to 2. In the others, models commonly have their collision shapes."""
SHADOW_SLACK = 1e-3
"""A surface this near (m) to where a lamp's ray ends is lit, not in its own shadow."""


class RayCamera:
    """One camera of a placed world, rendered by casting rays.

    Raises:
        SceneError: the world has no such camera.
    """

    def __init__(self, scene: Scene, placement: Placement, settings: CameraSettings, *, shadows: bool = False) -> None:
        """Prepare the rays; `shadows` lets the first lamp cast them."""
        self._settings = settings
        self._shadows = shadows
        self._width, self._height = image_size(scene, settings)
        self._model = scene.new_model()
        self._data = mujoco.MjData(self._model)
        placement.apply(scene, self._model, self._data.qpos)
        self._lighting = Lighting(self._model)
        self._camera = scene.index("camera", settings.name)
        self._colours, self._emitted = geom_colours(self._model)
        self._textures = plane_textures(self._model)
        self._fan = _fan(float(self._model.cam_fovy[self._camera]), self._width, self._height)

    def render(self, state: RenderState) -> Image:
        """Return the picture of a moment."""
        self._lighting.set_level(1.0 if self._settings.always_lit else state.light)
        eye, rays = self._rays(state)
        geoms, distances, normals = self._cast(eye, rays)
        hit = np.flatnonzero(geoms >= 0)
        points = eye + distances[hit, None] * rays[hit]
        light = self._light(points, normals[hit].astype(np.float32))
        picture = np.zeros((len(rays), 3), np.float32)
        picture[hit] = self._shade(geoms[hit], points, light, state.colours)
        image = np.rint(picture * 255.0).astype(np.uint8).reshape(self._height, self._width, 3)
        return expose(image, self._settings, state.step)

    def depths(self, state: RenderState) -> Depths:
        """Return the depths of a moment."""
        geoms, distances, _ = self._cast(*self._rays(state))
        depths = np.where(geoms >= 0, distances * -self._fan[:, 2], np.inf)
        return depths.astype(np.float32).reshape(self._height, self._width)

    def _rays(self, state: RenderState) -> tuple[Floats, Floats]:
        """Bring the world to a moment; return where the camera is and its rays (n, 3), in the world frame."""
        self._data.qpos[:] = state.qpos
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        return self._data.cam_xpos[self._camera], rotate(self._fan, self._data.cam_xmat[self._camera])

    def close(self) -> None:
        """Nothing is held."""

    def _cast(self, origin: Floats, rays: Floats) -> tuple[npt.NDArray[np.int32], Floats, Floats]:
        """Return the geom (-1: none), distance (m) and surface normal that each ray (n, 3) meets first."""
        count = len(rays)
        geoms, distances, normals = np.empty(count, np.int32), np.empty(count), np.empty((count, 3))
        mujoco.mj_multiRay(
            self._model,
            self._data,
            origin,
            rays.ravel(),
            SHOWN_GROUPS,
            True,
            NO_BODY,
            geoms,
            distances,
            normals.ravel(),
            count,
            mujoco.mjMAXVAL,
        )
        return geoms, distances, normals

    def _shade(
        self, geoms: npt.NDArray[np.int32], points: Floats, light: Brightness, shining: Mapping[int, Rgb]
    ) -> Brightness:
        """Return the colours (n, 3) between 0 and 1 of lit points (m, world frame) on geoms."""
        own, emitted = painted(self._colours, self._emitted, shining)
        colours = np.minimum(light * own[geoms] + emitted[geoms], 1.0)
        for texture in self._textures:
            on_plane = np.flatnonzero(geoms == texture.geom)
            colours[on_plane] *= texture.colours(self._data, points[on_plane])
        return np.asarray(colours, np.float32)

    def _light(self, points: Floats, normals: Brightness) -> Brightness:
        """Return how much red, green and blue light (n, 3) falls on surface points (m, world frame)."""
        headlight = self._model.vis.headlight
        forward = -self._data.cam_xmat[self._camera].reshape(3, 3)[:, 2].astype(np.float32)
        facing = np.maximum(-dot(normals, forward), 0.0)
        light = np.asarray(headlight.ambient + facing[:, None] * headlight.diffuse, np.float32)
        for lamp in range(self._model.nlight):
            if self._model.light_active[lamp]:
                light += self._model.light_ambient[lamp]
                light += self._lamp(lamp, points, normals)[:, None] * self._model.light_diffuse[lamp]
        return light

    def _lamp(self, lamp: int, points: Floats, normals: Brightness) -> Brightness:
        """Return the share (n) of a lamp's diffuse light that reaches each point."""
        share = lamp_share(self._model, self._data, lamp, points, normals)
        if self._shadows and lamp == 0 and not is_directional(self._model, lamp):
            origin = self._data.light_xpos[lamp]
            beams = (points - origin).astype(np.float32)
            distances = np.sqrt(dot(beams, beams))
            beams /= distances[:, None]
            _, reached, _ = self._cast(origin, beams.astype(np.float64))
            share *= reached > distances - SHADOW_SLACK
        return share


def _fan(fovy: float, width: int, height: int) -> Floats:
    """Return unit vectors (n, 3) in the camera's frame, row by row from the top.

    The frame has x right and y up, and looks along -z.

    The angle `fovy` (degrees) is the vertical field of view.
    """
    focal = height / 2.0 / math.tan(math.radians(fovy) / 2.0)
    x = np.arange(width) + 0.5 - width / 2.0
    y = height / 2.0 - np.arange(height) - 0.5
    rays = np.stack([*np.meshgrid(x, y), np.full((height, width), -focal)], axis=-1).reshape(-1, 3)
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True), np.float64)
