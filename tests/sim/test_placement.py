"""Promises about where things stand."""

import itertools
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from regraft.sim_service.layout.footprints import distance_to_rectangles, obstacle_rectangles
from regraft.sim_service.layout.placement import Placement, PlacementError, draw_placement
from regraft.sim_service.layout.placement_reading import placement_rules
from regraft.sim_service.layout.scene import Scene, SceneError, load_scene
from regraft.sim_service.layout.visibility import sees_body
from regraft.sim_service.robots import Place, Region, RobotSpec
from regraft.sim_service.simulation import Simulation
from tests.support.worlds import waffle

from .worlds import frog

SEEDS = range(80)


def test_placed_bodies_never_overlap_and_keep_their_distance() -> None:
    scene = frog()
    rules = {rule.body: rule for rule in placement_rules(scene)}
    placed_bodies = {part for body in rules for part in scene.subtree(scene.index("body", body))}
    obstacles = obstacle_rectangles(scene, placed_bodies)
    for seed in SEEDS:
        poses = draw_placement(scene, seed).poses
        for body, pose in poses.items():
            rule = rules[body]
            assert distance_to_rectangles(pose.x, pose.y, obstacles) >= rule.radius + rule.gap
        for (one, first), (other, second) in itertools.combinations(poses.items(), 2):
            distance = math.hypot(first.x - second.x, first.y - second.y)
            assert distance >= rules[one].radius + rules[other].radius + min(rules[one].gap, rules[other].gap)


def test_robot_touches_nothing_at_its_start() -> None:
    scene = frog()
    robot = set(scene.geoms_of(scene.index("body", "base")))
    for seed in SEEDS:
        model = scene.new_model()
        data = mujoco.MjData(model)
        draw_placement(scene, seed).apply(scene, model, data.qpos)
        mujoco.mj_forward(model, data)
        floor = scene.index("geom", "floor")
        touched = {int(geom) for pair in data.contact.geom for geom in pair} - robot
        assert touched <= {floor}


def test_hydrant_is_always_seen_by_the_corner_camera() -> None:
    scene = frog()
    for seed in SEEDS:
        model = scene.new_model()
        data = mujoco.MjData(model)
        draw_placement(scene, seed).apply(scene, model, data.qpos)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        assert sees_body(scene, model, data, "corner_camera", "hydrant")


def test_same_seed_gives_the_same_placement_and_others_differ() -> None:
    scene = frog()
    assert draw_placement(scene, 7) == draw_placement(frog(), 7)
    assert len({str(draw_placement(scene, seed).to_plain()) for seed in range(20)}) == 20


def test_placement_survives_plain_data() -> None:
    placement = draw_placement(frog(), 3)
    assert Placement.from_plain(placement.to_plain()) == placement


def test_crowded_world_is_refused_naming_the_body(tmp_path: Path) -> None:
    file = tmp_path / "crowded.xml"
    file.write_text(
        """<mujoco><custom><text name="place ball" data="x -.2 .2 y -.2 .2 gap .1"/></custom><worldbody>
        <body name="ball"><geom size=".1"/></body>
        <body name="box"><geom type="box" size=".5 .5 .5"/></body></worldbody></mujoco>"""
    )
    with pytest.raises(PlacementError, match=r"no place for 'ball' after \d+ draws with seed 4"):
        draw_placement(load_scene(file), 4)


def test_placed_objects_leave_the_dock_free_but_the_robot_may_start_on_it() -> None:
    scene = frog()
    rules = {rule.body: rule for rule in placement_rules(scene)}
    starts = []
    for seed in SEEDS:
        poses = draw_placement(scene, seed).poses
        for body in ("hydrant", "red_box", "orange_ball"):
            assert math.hypot(poses[body].x, poses[body].y) >= rules[body].radius + 0.5
        starts.append(math.hypot(poses["base"].x, poses["base"].y))
    assert min(starts) < 0.3


def test_a_rule_that_names_a_missing_site_or_says_a_word_twice_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "wrong.xml"
    world = """<mujoco><custom><text name="place ball" data="x -.2 .2 y -.2 .2 {}"/></custom><worldbody>
        <body name="ball"><geom size=".1"/></body></worldbody></mujoco>"""
    for rule, complaint in (("clear dock .5", "no site named 'dock'"), ("gap .1 gap .2", "'gap' is given twice")):
        file.write_text(world.format(rule))
        with pytest.raises(SceneError, match=complaint):
            placement_rules(load_scene(file))


CRATE = """<mujoco><custom><text name="place ball" data="x -1 1 y -1 1 gap .1"/></custom><worldbody>
<geom type="plane" size="5 5 .1"/><body name="ball"><geom size=".1"/></body>
<body name="crate"><freejoint/><geom type="box" size=".5 .5 .2" pos="0 0 .2"/></body></worldbody></mujoco>"""


def test_a_body_is_placed_with_its_gap_to_a_crate_that_can_be_pushed(tmp_path: Path) -> None:
    file = tmp_path / "crate.xml"
    file.write_text(CRATE)
    for seed in SEEDS:
        ball = draw_placement(load_scene(file), seed).poses["ball"]
        assert max(abs(ball.x), abs(ball.y)) >= 0.69


def test_a_body_is_placed_with_its_gap_to_a_robot_that_stands_where_its_file_has_it(tmp_path: Path) -> None:
    file = tmp_path / "room.xml"
    file.write_text(re.sub('<body name="crate">.*</body>', "", CRATE))
    robot = replace(waffle(), place=None, region=None)
    for seed in SEEDS:
        ball = draw_placement(load_scene(file, [robot]), seed).poses["ball"]
        assert math.hypot(ball.x, ball.y) >= robot.radius + 0.2 - 1e-9


TRAIN = """<mujoco><worldbody><body name="stand" pos="1 0 0"><geom size=".05"/></body>
<body name="base" pos="0.3 -0.1 .1" euler="0 0 90">{joint}<geom size=".1"/></body>
<body pos="0.3 -0.6 .1" euler="0 0 30"><freejoint/><geom size=".1"/></body>
<body name="gate" pos="-0.4 0.2 0" euler="0 0 -50"><joint/><geom size=".1"/></body></worldbody></mujoco>"""
"""A robot of several bodies, of which the base is the second."""
RULE = '<text name="place {}" data="x 1 1 y 2 2"/>'


def room_with(folder: Path, robot: str, rule: str = "", **how: Any) -> Scene:
    """Return a room with a robot, and maybe a rule of placement."""
    world, file = folder / "world.xml", folder / "robot.xml"
    custom = f"<custom>{rule}</custom>" if rule else ""
    world.write_text(f'<mujoco>{custom}<worldbody><geom type="plane" size="5 5 .1"/></worldbody></mujoco>')
    file.write_text(robot)
    return load_scene(world, [RobotSpec("left", str(file), radius=1.2, **how)])


def as_seen_from(base: str, scene: Scene, placement: Placement) -> npt.NDArray[np.float64]:
    """Return where the bodies of a train are, and how they are turned, as seen from its base."""
    model = scene.new_model()
    data = mujoco.MjData(model)
    placement.apply(scene, model, data.qpos)
    mujoco.mj_kinematics(model, data)
    number = scene.index("body", base)
    turned, parts = data.xmat[number].reshape(3, 3), slice(number - 1, number + 3)
    away = (data.xpos[parts] - data.xpos[number]) @ turned
    return np.concatenate([away, (turned.T @ data.xmat[parts].reshape(-1, 3, 3)).reshape(-1, 9)], axis=1)


@pytest.mark.parametrize("joint", ["<freejoint/>", ""])
@pytest.mark.parametrize(
    ("rule", "how"),
    [
        ("", {"region": Region((1.0, 1.0), (2.0, 2.0))}),
        (RULE.format("left/base"), {}),
        (RULE.format("left/base"), {"place": Place(-1.0, 0.5, 2.5)}),
        (RULE.format("left/base"), {"region": Region((-2.0, -1.0), (0.0, 0.5))}),
    ],
    ids=["region", "rule", "rule before place", "rule before region"],
)
def test_all_bodies_of_a_robots_file_move_as_one_to_where_its_base_is_drawn(
    tmp_path: Path, joint: str, rule: str, how: dict[str, Any]
) -> None:
    train = TRAIN.format(joint=joint)
    undrawn = as_seen_from("left/base", room_with(tmp_path, train), Placement({}))
    scene = room_with(tmp_path, train, rule, **how)
    for seed in range(5):
        simulation = Simulation(scene, seed)
        drawn, pose = simulation.placement.poses["left/base"], simulation.robot("left").pose()
        assert drawn.position == (1.0, 2.0)
        assert (pose.x, pose.y, pose.yaw) == pytest.approx((drawn.x, drawn.y, drawn.yaw))
        np.testing.assert_allclose(as_seen_from("left/base", scene, simulation.placement), undrawn, atol=1e-9)


def test_a_body_of_a_robots_file_that_has_a_rule_of_its_own_stays_there(tmp_path: Path) -> None:
    scene = room_with(
        tmp_path, TRAIN.format(joint=""), RULE.format("left/stand"), region=Region((-2.0, -2.0), (0.0, 0.0))
    )
    model = scene.new_model()
    draw_placement(scene, 1).apply(scene, model, model.qpos0)
    for name, place in (("left/base", (-2.0, 0.0)), ("left/stand", (1.0, 2.0))):
        assert tuple(model.body_pos[scene.index("body", name)][:2].tolist()) == place


def test_a_base_inside_another_body_is_refused_with_a_region(tmp_path: Path) -> None:
    inside = '<mujoco><worldbody><body><body name="base"><geom size=".1"/></body></body></worldbody></mujoco>'
    scene = room_with(tmp_path, inside, region=Region((1.0, 1.0), (1.0, 1.0)))
    with pytest.raises(SceneError, match="'left/base' can't be placed: it is not a child of the worldbody"):
        draw_placement(scene, 1)
