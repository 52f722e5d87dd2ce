"""Finding out which renderer works on this machine."""

import os
import subprocess
import sys
from dataclasses import dataclass
from typing import Literal

from sim_service.camera import Camera, CameraSettings
from sim_service.gl_camera import GLCamera
from sim_service.placement import Placement
from sim_service.ray_camera import RayCamera
from sim_service.scene import Scene

RendererName = Literal["egl", "osmesa", "ray"]
NAMES: tuple[RendererName, ...] = ("egl", "osmesa", "ray")
FORCE = "REGRAFT_RENDERER"
"""The environment variable that names the renderer to use, without trying any."""
TRY_TIMEOUT = 30.0


@dataclass(frozen=True, slots=True)
class Probe:
    """Which renderer to use, and what was learnt about each one tried, as (renderer, reason)."""

    renderer: RendererName
    reasons: tuple[tuple[str, str], ...]


def probe() -> Probe:
    """Choose EGL, else OSMesa, else the ray camera, which always works. Never raises.

    Back ends that don't work may crash, so each is tried in a process of its own.
    """
    reasons: list[tuple[str, str]] = []
    forced = os.environ.get(FORCE, "")
    if forced:
        for name in NAMES:
            if forced == name:
                return Probe(name, ((name, f"forced by {FORCE}"),))
        reasons.append((forced, f"{FORCE} must be egl, osmesa or ray; ignored"))
    for backend in ("egl", "osmesa"):
        failure = _try(backend)
        reasons.append((backend, failure or "works"))
        if failure is None:
            return Probe(backend, tuple(reasons))
    reasons.append(("ray", "needs no OpenGL"))
    return Probe("ray", tuple(reasons))


def make_camera(renderer: RendererName, scene: Scene, placement: Placement, settings: CameraSettings) -> Camera:
    """Return a camera drawn by the named renderer; raises SceneError if the world has no such camera."""
    if renderer == "ray":
        return RayCamera(scene, placement, settings)
    return GLCamera(scene, placement, settings, renderer)


def _try(backend: str) -> str | None:
    """Return why a back end does not work, or None if it does."""
    environment = {name: value for name, value in os.environ.items() if name != "PYOPENGL_PLATFORM"}
    environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    command = [sys.executable, "-m", "sim_service.gl_camera", backend]
    try:
        result = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=TRY_TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        return f"no picture within {TRY_TIMEOUT:.0f} s"
    except OSError as error:
        return f"could not be tried: {error}"
    if result.returncode == 0:
        return None
    lines = result.stderr.strip().splitlines()
    last = lines[-1] if lines else "no message"
    return f"crashed with signal {-result.returncode}" if result.returncode < 0 else last
