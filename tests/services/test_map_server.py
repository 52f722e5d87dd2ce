"""Promises of the map server."""

import math
from pathlib import Path

from regraft.bus_schema.messages.maps import Goals, OccupancyGrid
from regraft.sim_service.map_server import MapServer
from regraft.testing import Rig
from tests.support.worlds import FROG_WORLD, WORLD, robots_as_data

from .rigs import world_on


def test_map_and_goals_fit_the_world_of_the_same_seed() -> None:
    with Rig(seed=3) as rig:
        world = world_on(rig)
        rig.add(MapServer, parameters=FROG_WORLD)
        maps, goals = rig.collect("map", OccupancyGrid), rig.collect("goals", Goals)
        rig.advance(4.0)
        places = world.simulation.placement.poses
    assert len(maps) == len(goals) == 2
    grid = maps[0]
    assert grid.frame == "map"
    assert [goal.name for goal in goals[0].goals] == ["middle_box", "east_boxes", "west_box", "hydrant"]
    hydrant, goal = places["hydrant"], goals[0].goals[3].pose.pose
    column = int((hydrant.x - grid.origin.x) / grid.resolution)
    row = int((hydrant.y - grid.origin.y) / grid.resolution)
    assert grid.cells[row, column] == 100
    assert 0.6 < math.hypot(goal.x - hydrant.x, goal.y - hydrant.y) < 1.2
    assert abs(math.remainder(math.atan2(hydrant.y - goal.y, hydrant.x - goal.x) - goal.yaw, math.tau)) < 0.1


def test_a_world_with_another_physics_step_has_a_map(tmp_path: Path) -> None:
    for file in WORLD.parent.glob("*.xml"):
        (tmp_path / file.name).write_text(file.read_text().replace('timestep="0.002"', 'timestep="0.004"'))
    parameters = {**FROG_WORLD, "file": str(tmp_path / "world.xml")}
    with Rig(seed=3) as rig:
        world_on(rig, **parameters, tick_rate=25.0, control_period=0.008)
        rig.add(MapServer, parameters=parameters)
        maps = rig.collect("map", OccupancyGrid)
        rig.advance(2.0)
    assert len(maps) == 1


def test_a_map_is_made_without_the_devices_that_only_the_world_has_values_for() -> None:
    motors = {"name": "motors", "class": "regraft.sim_service.devices.joint_motors:JointMotors"}
    (robot,) = robots_as_data()
    parameters = {**FROG_WORLD, "robots": [{**robot, "devices": [motors, *robot["devices"]]}]}
    with Rig(seed=3) as rig:
        world_on(rig, **parameters, motors_actuators="left_wheel right_wheel")
        rig.add(MapServer, parameters=parameters)
        maps = rig.collect("map", OccupancyGrid)
        rig.advance(2.0)
    assert len(maps) == 1
