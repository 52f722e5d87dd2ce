"""Where a site of a robot is, in the frame of the robot's base."""

import mujoco
import numpy as np

from regraft.sim_service.devices.core.device_kit import DeviceKit

Position = tuple[float, float, float]
Orientation = tuple[float, float, float, float]


def mounted_at(kit: DeviceKit, site: int) -> tuple[Position, Orientation]:
    """Return a site's position (m) and orientation (quaternion x, y, z, w) in the robot's base frame.

    A site on a joint that moves has no fixed one: it is returned as it is at the start.
    """
    model, data, base = kit.model, kit.data, kit.base
    if int(model.site_bodyid[site]) == base:
        # Taken from the file as it is: a detour over the world frame would round.
        position, quaternion = model.site_pos[site], model.site_quat[site]
    else:
        to_base = data.xmat[base].reshape(3, 3).T
        position = to_base @ (data.site_xpos[site] - data.xpos[base])
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, (to_base @ data.site_xmat[site].reshape(3, 3)).ravel())
    x, y, z = (float(part) for part in position)
    w, i, j, k = (float(part) for part in quaternion)
    return (x, y, z), (i, j, k, w)
