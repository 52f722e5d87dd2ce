"""Loading a world of a run: its room or corridors are drawn, if its file has a rule for that."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
from regraft.sim_service.rooms.blocks import NoRoom, Room
from regraft.sim_service.rooms.building import build
from regraft.sim_service.rooms.corridor_rule import corridor_rule
from regraft.sim_service.rooms.corridors import draw_corridors
from regraft.sim_service.rooms.drawing import draw_room
from regraft.sim_service.rooms.rule import room_rule
from regraft.sim_service.rooms.words import GOALS, Rule

MAX_ATTEMPTS: Final = 40
RESOLUTION: Final = 0.05
"""m, of the map on which it is found out whether goals can be reached: that of map servers."""

Draw = Callable[[int, int, tuple[float, float] | None], Room]
"""Draws a room of a seed and an attempt, given what place to keep clear."""


def load_world(path: str | Path, robots: Sequence[RobotSpec], seed: int) -> Scene:
    """Return the world of a run with this seed: that of its file, with what is drawn by its rule, if it has one.

    The rule is the text `room` or `corridors`. In a world that is drawn everything finds its place, and every robot
    that moves can reach every goal: what does not fit is drawn again. Equal seeds give equal worlds, in any process.

    Raises:
        SceneError: see `load_scene`; the rule is wrong; no room was found in `MAX_ATTEMPTS` draws.
    """
    plain = load_scene(path, robots)
    found = _rule(plain)
    if found is None:
        return plain
    rule, draw = found
    site = _site(plain, rule)
    why: Exception | None = None
    for attempt in range(MAX_ATTEMPTS):
        try:
            room = draw(seed, attempt, site)
            scene = load_scene(path, robots, partial(build, room))
            _check(scene, room, rule, seed)
            return scene
        except (NoRoom, PlacementError, GoalError) as error:
            why = error
    raise SceneError(f"{plain.path}: no room after {MAX_ATTEMPTS} draws with seed {seed}; the last: {why}")


def _rule(scene: Scene) -> tuple[Rule, Draw] | None:
    """Return the rule of a world and what draws by it; raises SceneError if the world has two rules."""
    room, corridors = room_rule(scene), corridor_rule(scene)
    if room is not None and corridors is not None:
        raise SceneError(f"{scene.path}: has the texts 'room' and 'corridors': must have one of them")
    if room is not None:
        return room, partial(draw_room, room)
    return None if corridors is None else (corridors, partial(draw_corridors, corridors))


def _site(scene: Scene, rule: Rule) -> tuple[float, float] | None:
    """Return where the site is that is kept clear."""
    if rule.clear is None:
        return None
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    x, y = data.site_xpos[scene.index("site", rule.clear[0])][:2].tolist()
    return float(x), float(y)


def _check(scene: Scene, room: Room, rule: Rule, seed: int) -> None:
    """Place everything, and look whether each robot stands free, and if it moves can reach a pose before each goal.

    Raises:
        NoRoom, PlacementError, GoalError: something finds no place, or cannot be reached.
    """
    placement = draw_placement(scene, seed)
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    starts: dict[str, Pose2D] = {}
    for robot in scene.robots:
        x, y = data.xpos[scene.index("body", robot.body)][:2].tolist()
        starts[robot.body] = placement.poses.get(robot.body, Pose2D(x, y, 0.0))
        if robot.body not in placement.poses:
            _check_standing(robot, x, y, room)
    if GOALS not in scene.names("tuple"):
        return
    rasteriser = Rasteriser(scene, placement, rule.lidar, RESOLUTION)
    for robot in scene.robots:
        if scene.is_static(scene.index("body", robot.body)):
            continue
        viewing_goals(scene, rasteriser, GOALS, starts[robot.body], robot.radius)


def _check_standing(robot: RobotSpec, x: float, y: float, room: Room) -> None:
    """Raise NoRoom if a wall or a box was drawn where a robot stands."""
    for block in (*room.walls, *room.boxes):
        if block.distance(x, y) < robot.radius:
            raise NoRoom(f"{block.name} is where the robot {robot.body!r} stands")
