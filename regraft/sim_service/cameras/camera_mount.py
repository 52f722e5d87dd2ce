"""Where a camera of a world sits, in the frames of the bus."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from regraft.bus_schema.messages.geometry import Pose, Quaternion, Vector3
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import Scene


@dataclass(frozen=True, slots=True)
class CameraMount:
    """The pose of a camera's body frame (x forward, y left, z up), and its vertical field of view (rad).

    ``on_board`` cameras are carried by a body that moves; their pose is in the outermost such body's frame,
    that of others in the map frame.
    """

    pose: Pose
    on_board: bool
    vertical_field_of_view: float

    def horizontal_field_of_view(self, width: int, height: int) -> float:
        """Return the horizontal opening angle (rad) of pictures of this size in pixels."""
        return 2.0 * math.atan(math.tan(self.vertical_field_of_view / 2.0) * width / height)


def camera_mount(scene: Scene, placement: Placement, camera: str) -> CameraMount:
    """Return where the named camera sits; raises SceneError if there is none."""
    index = scene.index("camera", camera)
    model = scene.new_model()
    data = mujoco.MjData(model)
    placement.apply(scene, model, data.qpos)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    position, rotation = data.cam_xpos[index], data.cam_xmat[index].reshape(3, 3)
    body = int(model.cam_bodyid[index])
    on_board = not scene.is_static(body)
    if on_board:
        carrier = int(model.body_rootid[body])
        to_carrier = data.xmat[carrier].reshape(3, 3).T
        position, rotation = to_carrier @ (position - data.xpos[carrier]), to_carrier @ rotation
    # MuJoCo's cameras look along -z with y up; a body frame has x forward, y left, z up.
    axes = np.column_stack([-rotation[:, 2], -rotation[:, 0], rotation[:, 1]])
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, axes.ravel())
    w, x, y, z = (float(part) for part in quaternion)
    pose = Pose(Vector3(*(float(part) for part in position)), Quaternion(x, y, z, w))
    return CameraMount(pose, on_board, math.radians(float(model.cam_fovy[index])))
