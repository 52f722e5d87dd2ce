"""Where a camera of a world sits, in the frames of the bus."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from regraft.bus_schema.messages.geometry import Pose, Quaternion, Vector3
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import Scene, SceneError
from regraft.sim_service.robots import RobotSpec

BASE_FRAME, MAP_FRAME = "base_link", "map"


@dataclass(frozen=True, slots=True)
class CameraMount:
    """The pose of a camera's body frame (x forward, y left, z up), and its vertical field of view (rad).

    A camera that moves is in the ``frame`` of the robot that carries it: that of its base. Others are in the map's. A
    camera on a joint of its robot has no fixed pose: it is as at the start.
    """

    frame: str
    pose: Pose
    vertical_field_of_view: float

    def horizontal_field_of_view(self, width: int, height: int) -> float:
        """Return the horizontal opening angle (rad) of pictures of this size in pixels."""
        return 2.0 * math.atan(math.tan(self.vertical_field_of_view / 2.0) * width / height)


def camera_mount(scene: Scene, placement: Placement, camera: str) -> CameraMount:
    """Return where the named camera sits; raises SceneError if there is none, or no frame in which it is at rest."""
    index = scene.index("camera", camera)
    model = scene.new_model()
    data = mujoco.MjData(model)
    placement.apply(scene, model, data.qpos)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    position, rotation = data.cam_xpos[index], data.cam_xmat[index].reshape(3, 3)
    body, frame = int(model.cam_bodyid[index]), MAP_FRAME
    if not scene.is_static(body):
        robot = _carrier(scene, camera, body)
        frame, base = robot.prefix + BASE_FRAME, scene.index("body", robot.body)
        to_base = data.xmat[base].reshape(3, 3).T
        position, rotation = to_base @ (position - data.xpos[base]), to_base @ rotation
    # MuJoCo's cameras look along -z with y up; a body frame has x forward, y left, z up.
    axes = np.column_stack([-rotation[:, 2], -rotation[:, 0], rotation[:, 1]])
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, axes.ravel())
    w, x, y, z = (float(part) for part in quaternion)
    pose = Pose(Vector3(*(float(part) for part in position)), Quaternion(x, y, z, w))
    return CameraMount(frame, pose, math.radians(float(model.cam_fovy[index])))


def _carrier(scene: Scene, camera: str, body: int) -> RobotSpec:
    """Return the robot that a body is a part of; raises SceneError if it is none's."""
    bases = {scene.index("body", robot.body): robot for robot in scene.robots}
    part = body
    while part != 0:
        if part in bases:
            return bases[part]
        part = int(scene.model.body_parentid[part])
    thing = scene.body_name(int(scene.model.body_rootid[body]))
    why = f"is carried by {thing!r}, which moves and is no robot: its pictures would have no frame"
    raise SceneError(f"{scene.path}: the camera {camera!r} {why}")
