"""Finding out which renderer works on this machine."""

import os
import subprocess
from dataclasses import dataclass
from typing import Literal

from regraft.process.own_python import own_environment, own_python
from regraft.sim_service.cameras.camera import Camera, CameraSettings
from regraft.sim_service.cameras.gl_camera import LIBRARIES, LIBRARY_MISSING, Backend, GLCamera
from regraft.sim_service.cameras.ray_camera import RayCamera
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import Scene

RendererName = Literal["egl", "osmesa", "ray"]
NAMES: tuple[RendererName, ...] = ("egl", "osmesa", "ray")
FORCE = "REGRAFT_RENDERER"
"""The environment variable that names the renderer to use, without trying any."""
TRY_TIMEOUT = 30.0
BACKENDS: tuple[Backend, ...] = ("egl", "osmesa")
PACKAGES = "apt-get install libegl1 libgl1-mesa-dri (or libosmesa6)"
"""How Debian and Ubuntu get OpenGL without a display."""


@dataclass(frozen=True, slots=True)
class Probe:
    """Which renderer to use, and what was learnt about each one tried, as (renderer, reason).

    ``missing`` are the back ends whose library cannot be loaded; ``forced`` is true where nothing was tried.
    """

    renderer: RendererName
    reasons: tuple[tuple[str, str], ...]
    missing: tuple[Backend, ...] = ()
    forced: bool = False

    def notice(self) -> str | None:
        """Return why pictures are drawn slowly here and what to install; None with OpenGL, or if nothing was tried."""
        if self.renderer != "ray" or self.forced:
            return None
        if self.missing == BACKENDS:
            why = f"{' and '.join(LIBRARIES[backend][0] for backend in BACKENDS)} cannot be loaded"
        else:
            why = "; ".join(f"{name}: {reason}" for name, reason in self.reasons if name != "ray")
        return f"no OpenGL here ({why}): cameras use the slow built-in ray camera; to have OpenGL: {PACKAGES}"


def probe() -> Probe:
    """Choose EGL, else OSMesa, else the ray camera, which always works. Never raises.

    Back ends that don't work may crash, so each is tried in a process of its own.
    """
    reasons: list[tuple[str, str]] = []
    forced = os.environ.get(FORCE, "")
    if forced:
        for name in NAMES:
            if forced == name:
                return Probe(name, ((name, f"forced by {FORCE}"),), forced=True)
        reasons.append((forced, f"{FORCE} must be egl, osmesa or ray; ignored"))
    missing: list[Backend] = []
    for backend in BACKENDS:
        code, failure = _try(backend)
        if code == LIBRARY_MISSING:
            missing.append(backend)
        reasons.append((backend, failure or "works"))
        if code == 0:
            return Probe(backend, tuple(reasons))
    reasons.append(("ray", "needs no OpenGL"))
    return Probe("ray", tuple(reasons), tuple(missing))


def make_camera(renderer: RendererName, scene: Scene, placement: Placement, settings: CameraSettings) -> Camera:
    """Return a camera drawn by the named renderer; raises SceneError if the world has no such camera."""
    if renderer == "ray":
        return RayCamera(scene, placement, settings)
    return GLCamera(scene, placement, settings, renderer)


def _try(backend: Backend) -> tuple[int | None, str]:
    """Return the exit code of a trial, None without one, and why the back end does not work."""
    environment = {name: value for name, value in own_environment().items() if name != "PYOPENGL_PLATFORM"}
    command = own_python("-m", "regraft.sim_service.cameras.gl_camera", backend)
    try:
        result = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=TRY_TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        return None, f"no picture within {TRY_TIMEOUT:.0f} s"
    except OSError as error:
        return None, f"could not be tried: {error}"
    return result.returncode, _why(backend, result.returncode, result.stderr)


def _why(backend: Backend, code: int, errors: str) -> str:
    if code == 0:
        return ""
    if code == LIBRARY_MISSING:
        return f"{LIBRARIES[backend][0]} cannot be loaded"
    if code < 0:
        return f"crashed with signal {-code}"
    lines = errors.strip().splitlines()
    return lines[-1] if lines else "no message"
