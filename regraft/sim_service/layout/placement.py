"""Drawing where things stand at the start of a run."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.planar import Pose2D
from regraft.sim_service.layout.footprints import distance_to_rectangles, obstacle_rectangles
from regraft.sim_service.layout.headings import yaw_quaternion
from regraft.sim_service.layout.placement_reading import PlacementRule, placement_rules
from regraft.sim_service.layout.random_streams import generator
from regraft.sim_service.layout.scene import Scene
from regraft.sim_service.layout.visibility import sees_body
from regraft.sim_service.robots import RobotSpec

MAX_DRAWS = 2000
OUT_OF_THE_WAY = 1000.0
"""Height (m) at which bodies wait that have not been drawn yet."""


class PlacementError(RuntimeError):
    """No place was found for a body that satisfies its rule."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Ground poses (map frame) of the placed bodies, by name; all others stay as in the world file."""

    poses: Mapping[str, Pose2D]

    def apply(self, scene: Scene, model: mujoco.MjModel, qpos: npt.NDArray[np.float64]) -> None:
        """Move the bodies: static ones in the model, free ones in qpos. Heights stay as they are."""
        for name, pose in self.poses.items():
            _move(scene, model, qpos, name, pose)

    def to_plain(self) -> dict[str, list[float]]:
        """Return {body: [x, y, yaw]}, as plain data for a message or a file."""
        return {name: [pose.x, pose.y, pose.yaw] for name, pose in self.poses.items()}

    @staticmethod
    def from_plain(plain: Mapping[str, Any]) -> "Placement":
        """Return the placement that `to_plain` described."""
        return Placement({name: Pose2D(float(x), float(y), float(yaw)) for name, (x, y, yaw) in plain.items()})


def draw_placement(scene: Scene, seed: int) -> Placement:
    """Draw a place for every body with a rule, one after another in the order of the rules.

    Each body has its own random numbers: a new rule at the end of the file moves nothing of an earlier rule.

    Raises:
        SceneError: a rule is wrong.
        PlacementError: a body found no place in `MAX_DRAWS` draws.
    """
    return _Draw(scene, seed).run()


class _Draw:
    """One drawing of all bodies, on a model of its own."""

    def __init__(self, scene: Scene, seed: int) -> None:
        self._scene = scene
        self._seed = seed
        self._rules = placement_rules(scene)
        bodies = {scene.index("body", rule.body) for rule in self._rules}
        others = [robot for robot in scene.robots if scene.index("body", robot.body) not in bodies]
        free = {base for robot in others if scene.is_free(base := scene.index("body", robot.body))}
        ignored = {member for body in bodies | free for member in scene.subtree(body)}
        self._obstacles = obstacle_rectangles(scene, ignored)
        self._model = scene.new_model()
        self._data = mujoco.MjData(self._model)
        self._sites = _site_positions(scene)
        self._placed: list[tuple[PlacementRule, Pose2D]] = []
        self._taken = [(*_place_of(robot, scene), robot.radius) for robot in others]
        """Circles (x, y, radius in m) that a body has to leave free: of all other robots, and of what is placed."""

    def run(self) -> Placement:
        for rule in self._rules:
            self._lift(rule)
        for rule in self._rules:
            pose = self._draw(rule)
            self._placed.append((rule, pose))
            self._taken.append((pose.x, pose.y, rule.radius))
        return Placement({rule.body: pose for rule, pose in self._placed})

    def _draw(self, rule: PlacementRule) -> Pose2D:
        random = generator(self._seed, f"placement {rule.body}")
        for _ in range(MAX_DRAWS):
            x, y = random.uniform(*rule.x_range), random.uniform(*rule.y_range)
            pose = Pose2D(float(x), float(y), float(random.uniform(-math.pi, math.pi)))
            if self._has_room(rule, pose) and self._all_seen(rule, pose):
                return pose
        raise PlacementError(
            f"{self._scene.path}: no place for {rule.body!r} after {MAX_DRAWS} draws with seed {self._seed}: "
            f"radius {rule.radius:.2f} m, gap {rule.gap} m, x {rule.x_range}, y {rule.y_range}, "
            f"seen by {rule.seen_by}, clear of {rule.clear}"
        )

    def _has_room(self, rule: PlacementRule, pose: Pose2D) -> bool:
        if distance_to_rectangles(pose.x, pose.y, self._obstacles) < rule.radius + rule.gap:
            return False
        if rule.clear is not None:
            site_x, site_y = self._sites[rule.clear.site]
            if math.hypot(pose.x - site_x, pose.y - site_y) < rule.radius + rule.clear.distance:
                return False
        return all(
            math.hypot(pose.x - x, pose.y - y) >= rule.radius + radius + rule.gap for x, y, radius in self._taken
        )

    def _all_seen(self, rule: PlacementRule, pose: Pose2D) -> bool:
        """Return whether the cameras see this body and still see all bodies placed before it."""
        _move(self._scene, self._model, self._data.qpos, rule.body, pose)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        candidates = [placed for placed, _ in self._placed] + [rule]
        return all(
            sees_body(self._scene, self._model, self._data, candidate.seen_by, candidate.body)
            for candidate in candidates
            if candidate.seen_by is not None
        )

    def _lift(self, rule: PlacementRule) -> None:
        body = self._scene.index("body", rule.body)
        if self._scene.is_static(body):
            self._model.body_pos[body][2] += OUT_OF_THE_WAY
        else:
            self._data.qpos[self._scene.free_joint_position(rule.body) + 2] += OUT_OF_THE_WAY


def check_apart(scene: Scene, data: mujoco.MjData) -> None:
    """Check that no two robots stand in one place; raises PlacementError."""
    for one, other in combinations(scene.robots, 2):
        x, y = (data.xpos[scene.index("body", robot.body)] for robot in (one, other))
        distance = math.hypot(float(x[0] - y[0]), float(x[1] - y[1]))
        if distance < one.radius + other.radius:
            raise PlacementError(
                f"{scene.path}: the robots {one.name!r} and {other.name!r} stand {distance:.2f} m apart: "
                f"must be at least {one.radius + other.radius:.2f} m, the sum of their radii"
            )


def _place_of(robot: RobotSpec, scene: Scene) -> tuple[float, float]:
    """Return where a robot stands (x, y in m) whose place is not drawn: at its place, or where its MJCF has it."""
    if robot.place is not None:
        return robot.place.x, robot.place.y
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    x, y, _ = data.xpos[scene.index("body", robot.body)].tolist()
    return x, y


def _site_positions(scene: Scene) -> dict[str, tuple[float, float]]:
    """Return where the named sites lie (x, y in m) while nothing is placed yet."""
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    return {name: tuple(data.site_xpos[scene.index("site", name)][:2].tolist()) for name in scene.names("site")}


def _move(scene: Scene, model: mujoco.MjModel, qpos: npt.NDArray[np.float64], name: str, pose: Pose2D) -> None:
    body = scene.index("body", name)
    orientation = np.empty(4)
    if scene.is_static(body):
        mujoco.mju_mulQuat(orientation, yaw_quaternion(pose.yaw), scene.model.body_quat[body])
        model.body_pos[body] = (pose.x, pose.y, scene.model.body_pos[body][2])
        model.body_quat[body] = orientation
    else:
        first = scene.free_joint_position(name)
        mujoco.mju_mulQuat(orientation, yaw_quaternion(pose.yaw), scene.model.qpos0[first + 3 : first + 7])
        qpos[first : first + 3] = (pose.x, pose.y, scene.model.qpos0[first + 2])
        qpos[first + 3 : first + 7] = orientation
