"""A camera rendered by MuJoCo with OpenGL, without a display.

Shadows, reflections and multi-sampling are off: without a graphics card they cost ten times the rest.

``python -m regraft.sim_service.cameras.gl_camera BACKEND`` tries a back end. It exits with ``LIBRARY_MISSING`` where
its library cannot be loaded.
"""

import ctypes
import sys
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import mujoco
import numpy as np

from regraft.sim_service.cameras.camera import CameraSettings, Depths, Image, RenderState, Rgb, expose, image_size
from regraft.sim_service.cameras.room_lamps import Lighting
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import Scene

Backend = Literal["egl", "osmesa"]
LIBRARIES: dict[Backend, tuple[str, ...]] = {
    "egl": ("libEGL.so.1",),
    "osmesa": ("libOSMesa.so.8", "libOSMesa.so.6"),
}
"""The library of each back end, by the names that it may have: one of them must load."""
LIBRARY_MISSING = 3
MAX_GEOMS = 2000
PROBE_WORLD = """<mujoco><worldbody><light pos="0 0 3"/><geom size=".5" rgba="1 1 1 1"/>
<camera name="probe" pos="0 -2 0" xyaxes="1 0 0 0 0 1"/></worldbody></mujoco>"""


def make_context(backend: Backend, width: int, height: int) -> Any:
    """Return an OpenGL context, current in this thread. Failures are of every kind, even a crash."""
    # Importing these loads the library, which may be missing.
    if backend == "egl":
        from mujoco.egl import GLContext
    else:
        from mujoco.osmesa import GLContext
    context = GLContext(width, height)
    context.make_current()
    return context


class GLCamera:
    """One camera of a placed world, rendered with OpenGL. Create, use and close it in one thread.

    Raises:
        SceneError: the world has no such camera.
    """

    def __init__(self, scene: Scene, placement: Placement, settings: CameraSettings, backend: Backend) -> None:
        self._settings = settings
        self._width, self._height = image_size(scene, settings)
        self._model = scene.new_model()
        self._data = mujoco.MjData(self._model)
        placement.apply(scene, self._model, self._data.qpos)
        self._lighting = Lighting(self._model)
        buffer = self._model.vis.global_
        buffer.offwidth, buffer.offheight = self._width, self._height
        self._model.vis.quality.offsamples = 0
        self._view = mujoco.MjvCamera()
        self._view.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._view.fixedcamid = scene.index("camera", settings.name)
        self._options = mujoco.MjvOption()
        self._options.sitegroup[:] = 0
        self._picture = mujoco.MjvScene(self._model, MAX_GEOMS)
        self._picture.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        self._picture.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        self._context = make_context(backend, self._width, self._height)
        self._resources = mujoco.MjrContext(self._model, int(mujoco.mjtFontScale.mjFONTSCALE_100))
        self._select_buffer()

    def render(self, state: RenderState) -> Image:
        """Return the picture of a moment."""
        area = self._draw(state)
        image = np.empty((self._height, self._width, 3), np.uint8)
        mujoco.mjr_readPixels(image, None, area, self._resources)
        return expose(image[::-1].copy(), self._settings, state.step)

    def depths(self, state: RenderState) -> Depths:
        """Return the depths of a moment; nearer than the near plane of the MJCF's map nothing is seen."""
        self._resources.readDepthMap = int(mujoco.mjtDepthMap.mjDEPTH_ZEROFAR)
        area = self._draw(state)
        buffer = np.empty((self._height, self._width), np.float32)
        mujoco.mjr_readPixels(None, buffer, area, self._resources)
        extent, planes = float(self._model.stat.extent), self._model.vis.map
        near, far = float(planes.znear) * extent, float(planes.zfar) * extent
        # The buffer is linear in the inverse of the depth: 1 at the near plane, 0 at the far one.
        shares = buffer[::-1].astype(np.float64)
        depths = near * far / (near + shares * (far - near))
        return np.where(shares > 0.0, depths, np.inf).astype(np.float32)

    def _draw(self, state: RenderState) -> Any:
        """Draw a moment off screen and return the area of the picture."""
        self._context.make_current()
        self._select_buffer()
        self._lighting.set_level(1.0 if self._settings.always_lit else state.light)
        self._data.qpos[:] = state.qpos
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        area = mujoco.MjrRect(0, 0, self._width, self._height)
        mujoco.mjv_updateScene(
            self._model,
            self._data,
            self._options,
            None,
            self._view,
            mujoco.mjtCatBit.mjCAT_ALL,
            self._picture,
        )
        self._paint(state.colours)
        mujoco.mjr_render(area, self._picture, self._resources)
        return area

    def _paint(self, colours: Mapping[int, Rgb]) -> None:
        """Let geoms of the scene shine in colours of their own, until it is updated again."""
        if not colours:
            return
        for geom in self._picture.geoms[: self._picture.ngeom]:
            colour = colours.get(int(geom.objid)) if geom.objtype == mujoco.mjtObj.mjOBJ_GEOM else None
            if colour is not None:
                geom.rgba[:3] = colour
                geom.emission = 1.0

    def close(self) -> None:
        """Free the OpenGL context; closing twice is harmless."""
        if self._context is not None:
            self._context.make_current()
            self._resources.free()
            self._context.free()
            self._context = None

    def __enter__(self) -> Self:
        """Use the camera in a `with` block."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _select_buffer(self) -> None:
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._resources)
        if int(self._resources.currentBuffer) != int(mujoco.mjtFramebuffer.mjFB_OFFSCREEN):
            raise RuntimeError("this OpenGL has no off-screen buffer")


def try_backend(backend: Backend) -> None:
    """Render one picture and check that something is to be seen on it; for a process of its own."""
    model = mujoco.MjModel.from_xml_string(PROBE_WORLD)
    scene = Scene(Path("probe"), model, "")
    with GLCamera(scene, Placement({}), CameraSettings("probe", 32, 24), backend) as camera:
        if int(camera.render(RenderState(model.qpos0.copy(), 1.0, 0)).max()) == 0:
            raise RuntimeError(f"{backend} rendered a black picture")


def has_library(backend: Backend) -> bool:
    """Load the library of a back end; return whether there is one."""
    for name in LIBRARIES[backend]:
        try:
            ctypes.CDLL(name)
        except OSError:
            continue
        return True
    return False


def main(backend: Backend) -> int:
    """Try a back end; return the exit code. A back end that does not work raises, or crashes."""
    if not has_library(backend):
        return LIBRARY_MISSING
    try_backend(backend)
    return 0


if __name__ == "__main__":
    sys.exit(main("egl" if sys.argv[1] == "egl" else "osmesa"))
