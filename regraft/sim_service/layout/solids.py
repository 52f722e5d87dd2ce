"""Which points lie inside a geom."""

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.sim_service.layout.scene import Scene, SceneError

GEOM = mujoco.mjtGeom


def inside(
    scene: Scene, shape: int, size: npt.NDArray[np.float64], points: npt.NDArray[np.float64]
) -> npt.NDArray[np.bool_]:
    """Return for each point (..., 3; m, in the geom's own frame) whether a geom of this shape and size contains
    it.

    Raises:
        SceneError: the shape is not a box, sphere, ellipsoid, cylinder or capsule.
    """
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    if shape == int(GEOM.mjGEOM_BOX):
        result = (np.abs(points) <= size).all(axis=-1)
    elif shape == int(GEOM.mjGEOM_SPHERE):
        result = x**2 + y**2 + z**2 <= size[0] ** 2
    elif shape == int(GEOM.mjGEOM_ELLIPSOID):
        result = ((points / size) ** 2).sum(axis=-1) <= 1.0
    elif shape == int(GEOM.mjGEOM_CYLINDER):
        result = (x**2 + y**2 <= size[0] ** 2) & (np.abs(z) <= size[1])
    elif shape == int(GEOM.mjGEOM_CAPSULE):
        beyond = np.maximum(np.abs(z) - size[1], 0.0)
        result = x**2 + y**2 + beyond**2 <= size[0] ** 2
    else:
        name = GEOM(shape).name.removeprefix("mjGEOM_").lower()
        raise SceneError(f"{scene.path}: a map can't be made of a {name}; use boxes, spheres, ellipsoids, cylinders")
    return np.asarray(result, bool)
