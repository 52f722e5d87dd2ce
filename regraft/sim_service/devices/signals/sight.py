"""Straight lines between two points of a world, and what is in their way."""

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.sim_service.devices.core.device_kit import DeviceKit

Point = npt.NDArray[np.float64]
NO_BODY = -1
MAX_CASTS = 64
"""Surfaces that a line is followed through."""
PAST = 1e-6
"""m behind a surface from which the line continues, so that it does not meet the same surface again."""


def root_of(kit: DeviceKit, site: int) -> int:
    """Return the outermost body that carries a site."""
    return int(kit.model.body_rootid[kit.model.site_bodyid[site]])


def obstacles(kit: DeviceKit, start: Point, end: Point, *spared: int, most: int = MAX_CASTS) -> int:
    """Return how many things lie between two points (m, map frame); counting stops at ``most``.

    Each static geom is a thing, since a room may be one body. A body that moves is one with all that
    hangs on it. ``spared`` are outermost bodies that are not counted: the robots at both ends.
    """
    way = end - start
    length = float(np.linalg.norm(way))
    if length == 0.0:
        return 0
    way = way / length
    model, geom = kit.model, np.full(1, -1, np.int32)
    met: set[tuple[bool, int]] = set()
    travelled = 0.0
    for _ in range(MAX_CASTS):
        distance = mujoco.mj_ray(model, kit.data, start + travelled * way, way, None, True, NO_BODY, geom)
        travelled += distance + PAST
        if distance < 0.0 or travelled >= length or len(met) >= most:
            break
        body = int(model.geom_bodyid[geom[0]])
        root = int(model.body_rootid[body])
        if root not in spared:
            stands = int(model.body_weldid[body]) == 0
            met.add((stands, int(geom[0]) if stands else root))
    return len(met)


def is_clear(kit: DeviceKit, start: Point, end: Point, *spared: int) -> bool:
    """Return whether nothing lies between two points (m, map frame)."""
    return obstacles(kit, start, end, *spared, most=1) == 0
