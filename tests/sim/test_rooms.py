"""Promises about rooms that are drawn from the seed."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest

from regraft.sim_service.layout.ground_map import FREE
from regraft.sim_service.layout.placement import draw_placement
from regraft.sim_service.layout.scene import Scene, SceneError, load_scene
from regraft.sim_service.layout.visibility import sees_body
from regraft.sim_service.robots import Place
from regraft.sim_service.rooms.loading import load_world
from regraft.sim_service.simulation import Simulation
from regraft.sim_service.survey import goals, ground_map
from regraft.stacks.frog.studies.arms.scenarios import in_other_rooms
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE
from tests.support.worlds import WORLD, waffle

pytestmark = pytest.mark.slow

ROOMS, IN_VIEW = WORLD.with_name("rooms.xml"), WORLD.with_name("rooms_in_view.xml")
ROBOT = (waffle(),)
SEEDS = range(30)
WALL, BOX = "wall_", "box_"


def room(seed: int) -> Scene:
    """Return FROG's world with the room of a seed; that of a seed that several tests look at is drawn once."""
    return kept_room(seed) if seed in SEEDS else load_world(ROOMS, ROBOT, seed)


@cache
def kept_room(seed: int) -> Scene:
    """Draw a room, and keep it."""
    return load_world(ROOMS, ROBOT, seed)


def sizes(scene: Scene, begin: str) -> list[tuple[float, ...]]:
    """Return the half sides of the geoms whose names begin so."""
    names = [name for name in scene.names("geom") if name.startswith(begin) and name[len(begin)].isdigit()]
    return [tuple(scene.model.geom_size[scene.index("geom", name)].tolist()) for name in names]


def test_equal_seeds_give_equal_rooms_and_others_differ() -> None:
    first, second = (load_world(ROOMS, ROBOT, 7) for _ in range(2))
    assert first.fingerprint == second.fingerprint
    assert draw_placement(first, 7) == draw_placement(second, 7)
    assert len({room(seed).fingerprint for seed in SEEDS}) == len(SEEDS)


@pytest.mark.parametrize("first", range(0, 200, 50))
def test_the_robot_can_reach_every_goal_of_every_room(first: int) -> None:
    for seed in range(first, first + 50):
        found = goals(Simulation(room(seed), seed))
        assert [goal.name for goal in found] == ["box_1", "box_2", "box_3", "hydrant"]


def test_between_the_robot_and_its_goals_the_map_is_free_by_more_than_its_radius() -> None:
    for seed in SEEDS:
        simulation = Simulation(room(seed), seed)
        known = ground_map(simulation)
        free = (known.occupancy == FREE).astype(np.uint8)
        room_around = (cv2.distanceTransform(free, cv2.DIST_L2, 5) - 0.5) * known.resolution
        _, regions = cv2.connectedComponents((room_around >= ROBOT[0].radius).astype(np.uint8), connectivity=4)
        start = simulation.placement.poses["base"]
        reached = {int(regions[known.cell(goal.pose.x, goal.pose.y)]) for goal in goals(simulation)}
        assert reached == {int(regions[known.cell(start.x, start.y)])}
        assert 0 not in reached


def test_rooms_differ_in_walls_boxes_sizes_and_light() -> None:
    scenes = [room(seed) for seed in SEEDS]
    boxes = [sizes(scene, BOX) for scene in scenes]
    assert {len(each) for each in boxes} == {3, 4, 5, 6}
    assert all(0.075 <= half <= 0.25 for each in boxes for x, y, _ in each for half in (x, y))
    walls = [sizes(scene, WALL) for scene in scenes]
    assert {len({round(height, 6) for *_, height in each}) for each in walls} == {1, 2}
    assert all(0.1 <= height <= 0.25 for each in walls for *_, height in each)
    assert {x > y for each in walls for x, y, _ in each} == {True, False}
    plain = load_scene(ROOMS, ROBOT).model.light_diffuse[0][0]
    lamps = [scene.model.light_diffuse[0][0] / plain for scene in scenes]
    assert 0.6 <= min(lamps) < 0.7
    assert 0.9 < max(lamps) <= 1.0


def is_seen(file: Path, seed: int) -> bool:
    """Return whether the corner camera has the whole hydrant in view."""
    scene = room(seed) if file == ROOMS else load_world(file, ROBOT, seed)
    model = scene.new_model()
    data = mujoco.MjData(model)
    draw_placement(scene, seed).apply(scene, model, data.qpos)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    return sees_body(scene, model, data, "corner_camera", "hydrant")


def test_the_corner_camera_sees_the_hydrant_in_some_rooms_only() -> None:
    assert 0.1 < np.mean([is_seen(ROOMS, seed) for seed in SEEDS]) < 0.9


def test_in_rooms_in_view_the_corner_camera_sees_the_hydrant_and_the_robot_reaches_it() -> None:
    for seed in SEEDS:
        assert is_seen(IN_VIEW, seed)
        found = goals(Simulation(load_world(IN_VIEW, ROBOT, seed), seed))
        assert "hydrant" in [goal.name for goal in found]


def test_in_the_rooms_of_the_study_the_corner_camera_sees_the_hydrant_in_about_half() -> None:
    files = [WORLD.with_name(in_other_rooms(seed)["world"]) for seed in range(60)]
    assert 0.35 < np.mean([is_seen(file, seed) for seed, file in enumerate(files)]) < 0.65


@pytest.mark.parametrize("file", ["world.xml", "world_with_visitor.xml"])
def test_a_world_without_a_rule_is_the_same_for_every_seed(file: str) -> None:
    path = WORLD.with_name(file)
    expected = load_scene(path, ROBOT).fingerprint
    assert {load_world(path, ROBOT, seed).fingerprint for seed in (1, 2)} == {expected}


def world(folder: Path, rule: str) -> Path:
    """Write a world with a rule for its room."""
    file = folder / "room.xml"
    file.write_text(
        f"""<mujoco><custom><text name="room" data="{rule}"/></custom>
        <worldbody><geom type="plane" size="5 5 .1"/><site name="dock"/></worldbody></mujoco>"""
    )
    return file


@pytest.mark.parametrize(
    ("rule", "complaint"),
    [
        ("x 0 4", "text 'room' lacks 'y' and its range"),
        ("x 0 4 y 0 4 wals 1 2", "unknown word 'wals'; known are: x, y, walls"),
        ("x 0 4 y 0 4 walls 2 1", "'walls': 2 1: must be LOW HIGH"),
        ("x 0 4 y 0 4 boxes 1 1000", "'boxes': 1000: must be within 0 and 100"),
        ("x 0 4 y 0 4 boxes 1 2 visits 2", "'visits': 2: must be at most 1 boxes"),
        ("x 0 4 y 0 4 box_size 0 1", "'box_size': 0: must be more than 0 m"),
        ("x 0 4 y 0 4 lamps -1 1", "'lamps': -1: must be at least 0"),
        ("x 0 4 y 0 4 clear dok 1", "no site named 'dok'; there are: dock"),
        ("x 0 4 y 0 4 wall_material brick", "no material named 'brick'; there are: none"),
        ("x 0 nan y 0 4", "'x': nan: must be within"),
    ],
)
def test_a_wrong_rule_is_refused_naming_word_and_value(tmp_path: Path, rule: str, complaint: str) -> None:
    with pytest.raises(SceneError, match=complaint):
        load_world(world(tmp_path, rule), (), 1)


def test_a_room_in_which_nothing_fits_is_refused_naming_what_found_no_place(tmp_path: Path) -> None:
    file = world(tmp_path, "x 0 1 y 0 1 boxes 9 9 box_size .4 .4 gap .1")
    with pytest.raises(SceneError, match=r"no room after 40 draws with seed 3; the last: box_\d found no place"):
        load_world(file, (), 3)


def free_around(scene: Scene, x: float, y: float) -> float:
    """Return the distance (m) on the floor from a place to the nearest wall or box that was drawn."""
    data, nearest = mujoco.MjData(scene.model), np.inf
    mujoco.mj_kinematics(scene.model, data)
    for name in scene.names("geom"):
        if not name.startswith((WALL, BOX)):
            continue
        geom, place = scene.index("geom", name), np.array([x, y, 0.0])
        turn, middle, half = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom], scene.model.geom_size[geom]
        corner = middle + turn @ np.clip(turn.T @ (place - middle), -half, half)
        nearest = min(nearest, float(np.hypot(*(corner - place)[:2])))
    return nearest


def test_walls_and_boxes_leave_a_site_clear(tmp_path: Path) -> None:
    file = world(tmp_path, "x -2.5 2.5 y -2.5 2.5 walls 1 2 boxes 4 4 gap .1 clear dock .6")
    for seed in SEEDS:
        assert 0.6 - 1e-9 <= free_around(load_world(file, (), seed), 0.0, 0.0) < 5.0


def test_no_wall_or_box_is_drawn_where_a_robot_is_placed(tmp_path: Path) -> None:
    file = world(tmp_path, "x -2.5 2.5 y -2.5 2.5 walls 1 2 boxes 4 4 gap .1")
    placed = {"first": Place(1.0, -1.0), "second": Place(-1.2, 0.8, 2.0)}
    robots = tuple(waffle(name, place) for name, place in placed.items())
    without = [load_world(file, (), seed) for seed in SEEDS]
    assert any(free_around(scene, at.x, at.y) < 0.22 for scene in without for at in placed.values())
    for seed in SEEDS:
        scene = load_world(file, robots, seed)
        for at in placed.values():
            assert free_around(scene, at.x, at.y) >= 0.22 - 1e-9


FORKED = """
import cv2, os, signal, sys
from tests.sim.test_rooms import room
room(1)
child = os.fork()
if child == 0:
    signal.alarm(int(sys.argv[1]))
    cv2.setNumThreads(1)
    cv2.GaussianBlur(__import__("numpy").zeros((2000, 2000), "u1"), (9, 9), 0)
    os._exit(0)
print(os.waitpid(child, 0)[1])
"""


def test_a_process_that_has_loaded_a_room_can_be_forked() -> None:
    command = [sys.executable, "-c", FORKED, str(round(PATIENCE))]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=3 * PATIENCE)
    assert (ended.stdout, ended.returncode) == ("0\n", 0), ended.stderr
