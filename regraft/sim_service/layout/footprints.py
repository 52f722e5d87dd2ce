"""Outlines of geoms and bodies seen from above."""

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.sim_service.layout.scene import Scene

Floats = npt.NDArray[np.float64]


def world_box(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> tuple[Floats, Floats]:
    """Return the lowest and the highest corner (x, y, z in m, world frame) of the box around a geom."""
    centre, half = model.geom_aabb[geom][:3], model.geom_aabb[geom][3:]
    rotation = data.geom_xmat[geom].reshape(3, 3)
    middle = data.geom_xpos[geom] + rotation @ centre
    reach = np.abs(rotation) @ half
    return middle - reach, middle + reach


def body_box(scene: Scene, model: mujoco.MjModel, data: mujoco.MjData, body: int) -> tuple[Floats, Floats]:
    """Return the lowest and highest corner (m, world frame) of the box around a body and what hangs on it."""
    boxes = [world_box(model, data, geom) for geom in scene.geoms_of(body)]
    if not boxes:
        return data.xpos[body].copy(), data.xpos[body].copy()
    lows, highs = zip(*boxes, strict=True)
    return np.min(lows, axis=0), np.max(highs, axis=0)


def body_radius(scene: Scene, body: int) -> float:
    """Return the radius (m), seen from above, of a circle round the body's origin that contains it."""
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    low, high = body_box(scene, scene.model, data, body)
    origin = data.xpos[body]
    farthest = np.maximum(np.abs(low - origin), np.abs(high - origin))
    return float(np.hypot(farthest[0], farthest[1]))


def obstacle_rectangles(scene: Scene, ignored: set[int]) -> Floats:
    """Return the outlines (n, 4: x_min, y_min, x_max, y_max in m) of all geoms that stand on the floor.

    These are fixed to the world, or free as a crate is: people walk, and are none. Planes are floors, not
    obstacles, and what nothing collides with (a pad on the floor) is none either. Bodies in `ignored` are left out.
    """
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    rectangles = []
    for geom in range(scene.model.ngeom):
        body = int(scene.model.geom_bodyid[geom])
        is_floor = int(scene.model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_PLANE)
        in_no_way = not (scene.model.geom_contype[geom] or scene.model.geom_conaffinity[geom])
        stands = scene.is_static(body) or scene.is_free(body)
        if is_floor or in_no_way or body in ignored or not stands:
            continue
        low, high = world_box(scene.model, data, geom)
        rectangles.append((low[0], low[1], high[0], high[1]))
    return np.array(rectangles).reshape(-1, 4)


def distance_to_rectangles(x: float, y: float, rectangles: Floats) -> float:
    """Return the distance (m) from a point to the nearest rectangle: 0 inside, infinity if there is none."""
    if len(rectangles) == 0:
        return float("inf")
    beyond_x = np.maximum(np.maximum(rectangles[:, 0] - x, x - rectangles[:, 2]), 0.0)
    beyond_y = np.maximum(np.maximum(rectangles[:, 1] - y, y - rectangles[:, 3]), 0.0)
    return float(np.min(np.hypot(beyond_x, beyond_y)))
