"""Loading a world of a run: its room is drawn, if its file has a rule for that."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final

import mujoco

from regraft.planar import Pose2D
from regraft.sim_service.layout.goals import GoalError, viewing_goals
from regraft.sim_service.layout.ground_map import Rasteriser
from regraft.sim_service.layout.placement import PlacementError, draw_placement
from regraft.sim_service.layout.scene import Scene, SceneError, load_scene
from regraft.sim_service.robots import RobotSpec
from regraft.sim_service.rooms.building import build
from regraft.sim_service.rooms.drawing import NoRoom, draw_room
from regraft.sim_service.rooms.rule import RoomRule, room_rule

MAX_ATTEMPTS: Final = 40
RESOLUTION: Final = 0.05
"""m, of the map on which it is found out whether goals can be reached: that of map servers."""
GOALS: Final = "goals"


def load_world(path: str | Path, robots: Sequence[RobotSpec], seed: int) -> Scene:
    """Return the world of a run with this seed: that of its file, with a room that is drawn if it has a rule `room`.

    In a room that is drawn everything finds its place, and every robot can reach every goal: what does not fit is drawn
    again. Equal seeds give equal rooms, in any process.

    Raises:
        SceneError: see `load_scene`; the rule is wrong; no room was found in `MAX_ATTEMPTS` draws.
    """
    plain = load_scene(path, robots)
    rule = room_rule(plain)
    if rule is None:
        return plain
    site = _site(plain, rule)
    why: Exception | None = None
    for attempt in range(MAX_ATTEMPTS):
        try:
            room = draw_room(rule, seed, attempt, site)
            scene = load_scene(path, robots, partial(build, rule, room))
            _check_goals(scene, rule, seed)
            return scene
        except (NoRoom, PlacementError, GoalError) as error:
            why = error
    raise SceneError(f"{plain.path}: no room after {MAX_ATTEMPTS} draws with seed {seed}; the last: {why}")


def _site(scene: Scene, rule: RoomRule) -> tuple[float, float] | None:
    """Return where the site is that is kept clear."""
    if rule.clear is None:
        return None
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    x, y = data.site_xpos[scene.index("site", rule.clear[0])][:2].tolist()
    return float(x), float(y)


def _check_goals(scene: Scene, rule: RoomRule, seed: int) -> None:
    """Place everything, and look whether each robot can reach a pose in front of each goal.

    Raises:
        PlacementError, GoalError: something finds no place, or cannot be reached.
    """
    placement = draw_placement(scene, seed)
    if GOALS not in scene.names("tuple"):
        return
    rasteriser = Rasteriser(scene, placement, rule.lidar, RESOLUTION)
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    for robot in scene.robots:
        x, y = data.xpos[scene.index("body", robot.body)][:2].tolist()
        start = placement.poses.get(robot.body, Pose2D(x, y, 0.0))
        viewing_goals(scene, rasteriser, GOALS, start, robot.radius)
