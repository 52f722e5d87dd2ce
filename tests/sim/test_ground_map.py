"""Promises about maps and viewing goals made from worlds."""

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

from regraft.planar import Pose2D
from regraft.sim_service import survey
from regraft.sim_service.layout.goals import GoalError, viewing_goals
from regraft.sim_service.layout.ground_map import FREE, OCCUPIED, Rasteriser
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import SceneError, load_scene
from regraft.sim_service.layout.visibility import sees_body
from regraft.sim_service.simulation import Simulation
from tests.support.worlds import truth_of, turn_of

from .worlds import frog, frog_with_robot_at

ROOM_FOR_ROBOT = 0.22
WALLED_IN = """<mujoco><custom><tuple name="goals"><element objtype="body" objname="ball"/></tuple></custom>
<worldbody><body name="ball" pos="3 0 0"><geom size=".2"/></body>
<body name="wall" pos="1 0 0"><geom type="box" size=".05 5 .5"/></body>
<body name="far" pos="-5 0 0"><geom type="box" size=".05 5 .5"/></body></worldbody></mujoco>"""


def test_map_shows_walls_boxes_and_objects_but_not_the_robot() -> None:
    ground = survey.ground_map(frog_with_robot_at(-1.0, -1.0, 0.0))
    for x, y in [
        (-2.43, 0.0),
        (2.42, 0.0),
        (0.0, -2.36),
        (1.03, 0.54),
        (1.02, 0.85),
        (-1.18, 0.46),
        (0.0, 1.11),
    ]:
        assert not ground.is_free(x, y)
    for x, y in [(1.6, 1.7), (1.8, -1.8), (-1.8, 1.9)]:
        assert not ground.is_free(x, y)
    for x, y in [(-1.0, -1.0), (0.0, 0.0), (0.5, -1.5), (-1.5, 1.2)]:
        assert ground.is_free(x, y)
    assert ground.occupancy.dtype == np.int8
    assert set(np.unique(ground.occupancy)) == {FREE, OCCUPIED}


def test_map_agrees_with_the_lidar() -> None:
    simulation = Simulation(frog(), 11)
    ground, scan, truth = survey.ground_map(simulation), turn_of(simulation), truth_of(simulation).pose
    x = truth.x - 0.064 * math.cos(truth.yaw)
    y = truth.y - 0.064 * math.sin(truth.yaw)
    free_before = []
    for beam in np.flatnonzero(np.isfinite(scan.ranges)).tolist():
        angle, hit = truth.yaw + beam * scan.angle_increment, scan.ranges[beam]
        row, column = ground.cell(x + hit * math.cos(angle), y + hit * math.sin(angle))
        assert (ground.occupancy[row - 1 : row + 2, column - 1 : column + 2] == OCCUPIED).any()
        before = hit - 0.2
        free_before.append(ground.is_free(x + before * math.cos(angle), y + before * math.sin(angle)))
    assert np.mean(free_before) > 0.95


@pytest.mark.parametrize("seed", range(40))
def test_goals_are_free_reachable_and_face_their_object(seed: int) -> None:
    scene = frog()
    simulation = Simulation(scene, seed)
    ground, placement = survey.ground_map(simulation), simulation.placement
    goals = survey.goals(simulation)
    assert [goal.name for goal in goals] == ["middle_box", "east_boxes", "west_box", "hydrant"]
    rows, columns = np.nonzero(ground.occupancy == OCCUPIED)
    occupied = np.stack([columns + 0.5, rows + 0.5], axis=1) * ground.resolution + ground.origin
    for goal in goals:
        distances = np.linalg.norm(occupied - (goal.pose.x, goal.pose.y), axis=1)
        assert distances.min() > ROOM_FOR_ROBOT + ground.resolution / 2.0
        model = scene.new_model()
        data = mujoco.MjData(model)
        Placement({**placement.poses, "base": goal.pose}).apply(scene, model, data.qpos)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        assert sees_body(scene, model, data, "camera", goal.name)


def test_goal_that_cannot_be_reached_is_refused_by_name(tmp_path: Path) -> None:
    file = tmp_path / "walled_in.xml"
    file.write_text(WALLED_IN)
    scene = load_scene(file)
    rasteriser = Rasteriser(scene, Placement({}), 0.1, 0.05)
    with pytest.raises(GoalError, match="look at 'ball'"):
        viewing_goals(scene, rasteriser, "goals", Pose2D(-2.0, 0.0, 0.0), 0.22)
    seen = viewing_goals(scene, rasteriser, "goals", Pose2D(2.0, 0.0, 0.0), 0.22)
    assert seen[0].name == "ball"


def test_unknown_group_of_goals_is_named() -> None:
    with pytest.raises(SceneError, match="no tuple named 'treasures'; there are: goals"):
        survey.goals(frog_with_robot_at(0.0, 0.0, 0.0), "treasures")


def test_robot_that_starts_outside_the_map_is_told_so() -> None:
    scene = frog()
    rasteriser = Rasteriser(scene, Placement({}), 0.1, 0.05)
    with pytest.raises(GoalError, match=r"no room at its start \(-9\.00, 0\.00\)"):
        viewing_goals(scene, rasteriser, "goals", Pose2D(-9.0, 0.0, 0.0), 0.22)
