"""Whether a fixed camera sees a body whole."""

import itertools
import math

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.sim_service.layout.footprints import body_box
from regraft.sim_service.layout.scene import Scene

Floats = npt.NDArray[np.float64]


def sees_body(scene: Scene, model: mujoco.MjModel, data: mujoco.MjData, camera: str, body: str) -> bool:
    """Return whether all of the body is inside the camera's image, and no other body hides a geom of it.

    Needs the positions of `data` to be up to date (`mj_kinematics`, `mj_camlight`). A geom counts as hidden
    if the straight line from the camera to its centre meets another body first.
    """
    camera_number, body_number = scene.index("camera", camera), scene.index("body", body)
    low, high = body_box(scene, model, data, body_number)
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    if not _inside_image(model, data, camera_number, corners):
        return False
    geoms = scene.geoms_of(body_number)
    first_hits = _first_hits(model, data, data.cam_xpos[camera_number], data.geom_xpos[geoms])
    return set(first_hits.tolist()) <= set(geoms)


def _inside_image(model: mujoco.MjModel, data: mujoco.MjData, camera: int, points: Floats) -> bool:
    rotation = data.cam_xmat[camera].reshape(3, 3)
    in_camera = (points - data.cam_xpos[camera]) @ rotation
    depth = -in_camera[:, 2]
    if np.any(depth <= 0.0):
        return False
    width, height = model.cam_resolution[camera]
    half_height = math.tan(math.radians(float(model.cam_fovy[camera])) / 2.0)
    half_width = half_height * width / height
    across, up = np.abs(in_camera[:, 0]) / depth, np.abs(in_camera[:, 1]) / depth
    return bool(np.all(across <= half_width) and np.all(up <= half_height))


def _first_hits(model: mujoco.MjModel, data: mujoco.MjData, eye: Floats, targets: Floats) -> npt.NDArray[np.int32]:
    rays = targets - eye
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    geoms = np.empty(len(rays), np.int32)
    distances = np.empty(len(rays))
    no_body = -1
    mujoco.mj_multiRay(
        model,
        data,
        eye,
        rays.ravel(),
        None,
        True,
        no_body,
        geoms,
        distances,
        None,
        len(rays),
        mujoco.mjMAXVAL,
    )
    return geoms
