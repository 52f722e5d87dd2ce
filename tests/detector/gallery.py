"""Pictures of FROG's room whose truth is known: of the hydrant in all distances and lights, and without it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.sensors import Image
from regraft.planar import Pose2D
from regraft.sim_service import survey
from regraft.sim_service.cameras.camera import CameraSettings, RenderState, SensorNoise
from regraft.sim_service.cameras.camera_mount import camera_mount
from regraft.sim_service.cameras.renderers import RendererName, make_camera
from regraft.sim_service.layout.ground_map import GroundMap
from regraft.sim_service.layout.placement import Placement, draw_placement
from regraft.sim_service.layout.scene import Scene
from regraft.sim_service.simulation import Simulation
from tests.services.rigs import SIZES
from tests.support.worlds import frog_scene

NEAREST, FARTHEST = 0.4, 3.0
"""m, from the camera to the hydrant's axis."""
ELSEWHERE = Pose2D(40.0, 40.0, 0.0)
"""Where nobody sees a hydrant: outside, behind walls that are higher than it."""
BODY_RADIUS = 0.22
HYDRANT_RADIUS = 0.11
SIGHT_HEIGHTS = (0.05, 0.2, 0.33)
BATCH = 4000


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture, where the robot was, how dark it was, and where the hydrant is, if it is in view at all."""

    seed: int
    darkness: float
    robot: Pose2D
    hydrant: Pose2D | None
    distance: float
    image: Image

    @property
    def robot_pose(self) -> Pose:
        """The robot's pose in the map, as odometry tells it."""
        return Pose.planar(self.robot.x, self.robot.y, self.robot.yaw)


class Gallery:
    """The on-board camera in rooms as they are drawn for each seed."""

    def __init__(self, renderer: RendererName) -> None:
        self.renderer = renderer
        self.scene = frog_scene()

    def with_hydrant(self, seed: int, poses: int, levels: int = 10) -> Iterator[Shot]:
        """Yield pictures with the hydrant in view: from random poses, each in as many lights.

        Distances are spread evenly, their logarithms, from 0.4 to 3 m; darkness evenly within each of ``levels`` bins.
        """
        placement = draw_placement(self.scene, seed)
        random = np.random.default_rng([seed, 1])
        with _Room(self.scene, placement, self.renderer, seed) as room:
            for _ in range(poses):
                robot, distance = room.before_hydrant(random)
                for level in range(levels):
                    darkness = float((level + random.random()) / levels)
                    yield Shot(
                        seed, darkness, robot, placement.poses["hydrant"], distance, room.picture(robot, darkness)
                    )

    def without_hydrant(self, seed: int, poses: int, levels: int = 10) -> Iterator[Shot]:
        """Yield pictures of a room without a hydrant, every other one with a distractor ahead."""
        drawn = draw_placement(self.scene, seed)
        placement = Placement({**drawn.poses, "hydrant": ELSEWHERE})
        random = np.random.default_rng([seed, 2])
        with _Room(self.scene, placement, self.renderer, seed) as room:
            for n in range(poses):
                robot = room.anywhere(random, ("red_box", "", "orange_ball", "")[n % 4])
                for level in range(levels):
                    darkness = float((level + random.random()) / levels)
                    yield Shot(seed, darkness, robot, None, math.inf, room.picture(robot, darkness))


class _Room:
    """A placed world with one on-board camera."""

    def __init__(self, scene: Scene, placement: Placement, renderer: RendererName, seed: int) -> None:
        self._scene, self._placement = scene, placement
        self._mount = camera_mount(scene, placement, "camera")
        self._size = SIZES[renderer]
        settings = CameraSettings("camera", *self._size, noise=SensorNoise(), seed=seed)
        self._eye = make_camera(renderer, scene, placement, settings)
        self._model = scene.new_model()
        self._data = mujoco.MjData(self._model)
        self._qpos = scene.model.qpos0.copy()
        placement.apply(scene, self._model, self._qpos)
        self._ground: GroundMap = survey.ground_map(Simulation(scene, seed, placement=placement))
        self._taken = 0

    def __enter__(self) -> _Room:
        return self

    def __exit__(self, *_: object) -> None:
        self._eye.close()

    def before_hydrant(self, random: np.random.Generator) -> tuple[Pose2D, float]:
        """Return a free pose from which the hydrant is in view, and the camera's distance from its axis."""
        hydrant = self._placement.poses["hydrant"]
        half = self._mount.horizontal_field_of_view(*self._size) / 2.0
        mount = self._mount.pose
        for _ in range(BATCH):
            distance = NEAREST * (FARTHEST / NEAREST) ** float(random.random())
            most = half - math.asin(HYDRANT_RADIUS / distance)
            bearing, heading = float(random.uniform(-most, most)), float(random.uniform(-math.pi, math.pi))
            yaw = heading - bearing
            camera_x = hydrant.x - distance * math.cos(heading)
            camera_y = hydrant.y - distance * math.sin(heading)
            x = camera_x - math.cos(yaw) * mount.x + math.sin(yaw) * mount.y
            y = camera_y - math.sin(yaw) * mount.x - math.cos(yaw) * mount.y
            robot = Pose2D(x, y, yaw)
            if self._is_free(x, y) and self._sees_hydrant(robot, hydrant):
                return robot, distance
        raise RuntimeError("no pose found from which the hydrant is in view")

    def anywhere(self, random: np.random.Generator, facing: str) -> Pose2D:
        """Return a free pose; facing a body if one is named."""
        while True:
            x, y, yaw = (float(v) for v in random.uniform((-2.1, -2.1, -math.pi), (2.1, 2.2, math.pi)))
            if self._is_free(x, y):
                break
        if facing:
            body = self._placement.poses[facing]
            yaw = math.atan2(body.y - y, body.x - x) + float(random.uniform(-0.4, 0.4))
        return Pose2D(x, y, yaw)

    def picture(self, robot: Pose2D, darkness: float) -> Image:
        """Take a picture; each has its own noise."""
        self._put(robot)
        self._taken += 1
        pixels = self._eye.render(RenderState(self._qpos.copy(), 1.0 - darkness, self._taken))
        opening = self._mount.horizontal_field_of_view(*self._size)
        return Image(0.0, "camera_optical", "base_link", self._mount.pose, opening, pixels)

    def _is_free(self, x: float, y: float) -> bool:
        ring = [(0.0, 0.0), *((math.cos(a), math.sin(a)) for a in np.linspace(0.0, math.tau, 12, endpoint=False))]
        return all(self._ground.is_free(x + BODY_RADIUS * dx, y + BODY_RADIUS * dy) for dx, dy in ring)

    def _put(self, robot: Pose2D) -> None:
        first = self._scene.free_joint_position("base")
        self._qpos[first : first + 2] = (robot.x, robot.y)
        self._qpos[first + 3 : first + 7] = (math.cos(robot.yaw / 2), 0.0, 0.0, math.sin(robot.yaw / 2))

    def _sees_hydrant(self, robot: Pose2D, hydrant: Pose2D) -> bool:
        """Tell whether nothing stands between the camera and either side of the hydrant."""
        self._put(robot)
        self._data.qpos[:] = self._qpos
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        eye = np.array(self._data.cam_xpos[self._scene.index("camera", "camera")])
        away = math.atan2(hydrant.y - eye[1], hydrant.x - eye[0]) + math.pi / 2
        for height in SIGHT_HEIGHTS:
            for aside in (-HYDRANT_RADIUS, 0.0, HYDRANT_RADIUS):
                aim = np.array([hydrant.x + aside * math.cos(away), hydrant.y + aside * math.sin(away), height]) - eye
                length = float(np.linalg.norm(aim))
                hit = np.zeros(1, np.int32)
                reached = mujoco.mj_ray(self._model, self._data, eye, aim / length, None, 1, -1, hit, None)
                if 0.0 <= reached < length - 0.15:
                    return False
        return True
