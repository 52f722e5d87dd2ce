"""Drawing where things stand at the start of a run."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.planar import Pose2D
from regraft.sim_service.layout.footprints import distance_to_rectangles, obstacle_rectangles
from regraft.sim_service.layout.headings import yaw_of_matrix, yaw_quaternion
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
        """Move the bodies: free ones in qpos, others in the model. Heights stay as they are."""
        for name, pose in self.poses.items():
            _move(scene, model, qpos, name, pose, _moving(scene, name, self.poses))

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
        placed = [rule.body for rule in self._rules]
        self._moving = {body: _moving(scene, body, placed) for body in placed}
        bodies = {body for moving in self._moving.values() for body in moving}
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
        _move(self._scene, self._model, self._data.qpos, rule.body, pose, self._moving[rule.body])
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        candidates = [placed for placed, _ in self._placed] + [rule]
        return all(
            sees_body(self._scene, self._model, self._data, candidate.seen_by, candidate.body)
            for candidate in candidates
            if candidate.seen_by is not None
        )

    def _lift(self, rule: PlacementRule) -> None:
        for body in self._moving[rule.body]:
            first = self._scene.free_coordinates(body)
            if first is None:
                self._model.body_pos[body][2] += OUT_OF_THE_WAY
            else:
                self._data.qpos[first + 2] += OUT_OF_THE_WAY


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


def _moving(scene: Scene, name: str, placed: Iterable[str]) -> list[int]:
    """Return the bodies that move as one with a placed one: those of its robot's file without a place of their own."""
    own = scene.index("body", name)
    others = {scene.index("body", body) for body in placed} - {own}
    parts = next((scene.parts.get(robot.name) for robot in scene.robots if robot.body == name), None)
    return [body for body in parts or (own,) if body not in others]


def _move(
    scene: Scene,
    model: mujoco.MjModel,
    qpos: npt.NDArray[np.float64],
    name: str,
    pose: Pose2D,
    moving: Iterable[int],
) -> None:
    placed = scene.index("body", name)
    motion = pose.compose(_pose_in_file(scene, placed, name).inverse())
    for body in moving:
        first = scene.free_coordinates(body)
        position, orientation = scene.model.body_pos[body], np.empty(4)
        mujoco.mju_mulQuat(orientation, yaw_quaternion(motion.yaw), scene.model.body_quat[body])
        # The placed one stands at its pose exactly.
        at = pose if body == placed else motion.compose(Pose2D(float(position[0]), float(position[1])))
        if first is None:
            model.body_pos[body] = (at.x, at.y, position[2])
            model.body_quat[body] = orientation
        else:
            qpos[first : first + 3] = (at.x, at.y, position[2])
            qpos[first + 3 : first + 7] = orientation


def _pose_in_file(scene: Scene, body: int, name: str) -> Pose2D:
    """Return where a body is in the file. A robot's base has a heading there; other things are turned as they are."""
    x, y, _ = scene.model.body_pos[body].tolist()
    if all(robot.body != name for robot in scene.robots):
        return Pose2D(x, y)
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, scene.model.body_quat[body])
    return Pose2D(x, y, yaw_of_matrix(rotation))
