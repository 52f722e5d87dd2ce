"""Promises about several robots in one world: each has names, commands, noise and contacts of its own."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import mujoco
import numpy as np
import pytest

from regraft import Parameter
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.sensors import LaserScan, Odometry
from regraft.bus_schema.messages.world import GroundTruth, WorldState
from regraft.component.component import parameter_set
from regraft.component.parameters import ParameterError
from regraft.sim_service.cameras.camera import Rgb
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.drive import DifferentialDrive
from regraft.sim_service.devices.lidar import Lidar
from regraft.sim_service.layout.placement import Placement, PlacementError
from regraft.sim_service.layout.scene import Scene, SceneError, load_scene
from regraft.sim_service.robots import Place, Region, RobotSpec
from regraft.sim_service.rooms.loading import load_world
from regraft.sim_service.simulation import Simulation
from regraft.sim_service.world import TRUTH, World
from regraft.testing import Rig
from tests.services.rigs import run
from tests.support.worlds import WAFFLE, robots_as_data, waffle

ROOM = """
<mujoco>
  <option timestep="0.002" integrator="implicitfast" jacobian="dense"/>
  <worldbody>
    <geom type="plane" size="6 6 .1"/>
    <body name="wall"><geom type="box" pos="3 0 .25" size=".1 3 .25"/></body>
  </worldbody>
</mujoco>
"""
LEFT, RIGHT = Place(0.0, 1.0), Place(0.0, -1.0)


@pytest.fixture
def room(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the file of a room without rules of placement."""
    file = tmp_path_factory.mktemp("world") / "room.xml"
    file.write_text(ROOM)
    return str(file)


def two(room: str, left: RobotSpec | None = None, right: RobotSpec | None = None) -> Scene:
    """Return the room with two robots."""
    return load_scene(room, (left or waffle("left", LEFT), right or waffle("right", RIGHT)))


def test_a_command_moves_the_robot_that_it_is_for(room: str) -> None:
    simulation = Simulation(two(room), 1)
    simulation.robot("left").device("drive", DifferentialDrive).command(0.2, 0.0)
    simulation.advance(0.4)
    left, right = simulation.robot("left").pose(), simulation.robot("right").pose()
    assert left.x > 0.05
    assert (right.x, right.y) == pytest.approx((0.0, -1.0), abs=1e-3)


def test_the_fastest_command_that_there_is_stops_no_other_robot_and_drives_its_own(room: str) -> None:
    simulation = Simulation(two(room), 1)
    for _ in range(20):
        simulation.robot("left").device("drive", DifferentialDrive).command(1e308, -1e308)
        simulation.robot("right").device("drive", DifferentialDrive).command(0.2, 0.0)
        simulation.advance(0.05)
    left, right = (simulation.robot(name).truth(1.0).twist for name in ("left", "right"))
    assert right.v == pytest.approx(0.2, abs=0.01)
    assert left.v > 0.1
    assert left.w < -0.1


def test_a_further_robot_changes_no_noise_of_the_others(room: str) -> None:
    alone = Simulation(load_scene(room, (waffle("left", LEFT),)), 5)
    both = Simulation(two(room, right=waffle("right", Place(-5.0, -5.0))), 5)
    for simulation in (alone, both):
        simulation.advance(0.2)
    turns = [simulation.robot("left").device("scan", Lidar).turn() for simulation in (alone, both)]
    np.testing.assert_allclose(turns[0].ranges, turns[1].ranges, atol=1e-6)


def test_two_of_a_kind_have_noise_of_their_own(room: str) -> None:
    simulation = Simulation(two(room), 5)
    left, right = (simulation.robot(name).device("scan", Lidar) for name in ("left", "right"))
    noise = [device.kit.random("lidar lidar", 0).standard_normal(8) for device in (left, right)]
    assert (noise[0] != noise[1]).all()


def test_robots_that_meet_are_in_contact_with_each_other(room: str) -> None:
    simulation = Simulation(two(room, right=waffle("right", Place(0.6, 1.0, math.pi))), 1)
    for _ in range(60):
        simulation.robot("left").device("drive", DifferentialDrive).command(0.2, 0.0)
        simulation.advance(0.05)
    assert [event.body for event in simulation.robot("left").contacts.take_events()][:1] == ["right/base"]
    assert [event.body for event in simulation.robot("right").contacts.take_events()][:1] == ["left/base"]


def test_a_run_with_two_robots_continues_from_its_snapshot_bit_by_bit(room: str) -> None:
    first = Simulation(two(room), 3)
    for simulation in (first,):
        simulation.robot("left").device("drive", DifferentialDrive).command(0.2, 0.5)
        simulation.advance(0.25)
    second = Simulation(two(room), 99)
    second.restore(first.snapshot())
    for simulation in (first, second):
        simulation.advance(0.5)
    assert first.digest() == second.digest()
    assert first.snapshot() == second.snapshot()


def test_a_place_is_drawn_in_a_region_with_room_to_the_other_robot(room: str) -> None:
    right = replace(waffle("right"), region=Region((-1.0, 1.0), (-1.0, 1.0), 0.2))
    for seed in range(20):
        simulation = Simulation(two(room, waffle("left", Place(0.0, 0.0)), right), seed)
        left, other = simulation.robot("left").pose(), simulation.robot("right").pose()
        assert math.dist(left.position, other.position) >= 0.44


OFFSET = """<mujoco><worldbody><body name="stand" pos="1 0 0"><geom size=".05"/></body>
<body name="base" pos="{at}" euler="{turned}">{joint}<geom size=".1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("joint", ["<freejoint/>", ""])
@pytest.mark.parametrize(("at", "turned"), [("0.3 -0.1 .1", "0 0 90"), ("0 0 .1", "0 0 90"), ("0.3 0 .1", "0 20 0")])
@pytest.mark.parametrize("place", [Place(1.0, 1.0), Place(-1.5, 0.5, 2.5)])
def test_a_base_stands_at_its_place_wherever_its_own_file_has_it(
    room: str, tmp_path: Path, joint: str, at: str, turned: str, place: Place
) -> None:
    file = tmp_path / "robot.xml"
    file.write_text(OFFSET.format(at=at, turned=turned, joint=joint))
    simulation = Simulation(two(room, left=RobotSpec("left", str(file), radius=0.1, place=place)), 1)
    pose = simulation.robot("left").pose()
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((place.x, place.y, place.yaw), abs=1e-9)
    assert simulation.robot("right").pose().position == (RIGHT.x, RIGHT.y)


def test_the_other_bodies_of_a_robots_file_stay_where_they_are_as_seen_from_its_base(room: str, tmp_path: Path) -> None:
    file = tmp_path / "robot.xml"
    file.write_text(OFFSET.format(at="0 0 0", turned="0 0 90", joint=""))
    scene = two(room, left=RobotSpec("left", str(file), radius=0.1, place=Place(0.0, 2.0)))
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    # In its file the stand is to the right of the base.
    assert data.xpos[scene.index("body", "left/stand")] == pytest.approx((0.0, 1.0, 0.0), abs=1e-9)


def test_a_place_for_a_robot_that_the_worlds_file_has_itself_is_refused(room: str) -> None:
    robot = {"name": "", "place": {"x": 2.0, "y": 2.0}}
    with Rig() as rig, pytest.raises(ParameterError, match=r"robots\.0\.place.*the world's file has the robot"):
        rig.add(World, parameters={"file": room, "robots": [robot]})


DRAWN = """<mujoco><custom>
<text name="room" data="x -2.5 2.5 y -2.5 2.5 walls 1 1 boxes 2 2 gap .2 visits 1 clear post .3"/></custom>
<worldbody><geom type="plane" size="5 5 .1"/><site name="post" pos="2 2 0"/></worldbody></mujoco>"""
POST = """<mujoco><worldbody>
<body name="base"><geom type="box" size=".05 .05 .2" pos="0 0 .2"/></body></worldbody></mujoco>"""


def test_a_robot_that_cannot_drive_need_reach_no_goal_of_a_room(tmp_path: Path) -> None:
    world, post = tmp_path / "world.xml", tmp_path / "post.xml"
    world.write_text(DRAWN)
    post.write_text(POST)
    still = RobotSpec("post", str(post), radius=0.1, place=Place(2.0, 2.0))
    scene = load_world(world, (waffle("rescuer", Place(0.0, 0.0)), still), 1)
    assert scene.names("geom").count("box_1") == 1
    # A robot that drives, and has no room to, still finds no room.
    with pytest.raises(SceneError, match="no room after 40 draws"):
        load_world(world, (replace(waffle("rescuer", Place(0.0, 0.0)), radius=3.0), still), 1)


def test_two_robots_in_one_place_are_refused_by_name(room: str) -> None:
    with pytest.raises(PlacementError, match=r"'left' and 'right' stand 0\.10 m apart: must be at least 0\.44 m"):
        Simulation(two(room, right=waffle("right", Place(0.1, 1.0))), 1, placement=Placement({}))


def test_a_name_used_twice_is_refused(room: str) -> None:
    with pytest.raises(SceneError, match="two robots have the name 'left'"):
        two(room, right=waffle("left", RIGHT))


def test_a_robot_without_its_body_is_refused_by_file(room: str) -> None:
    with pytest.raises(SceneError, match=r"waffle\.xml: the robot 'left' has no body 'torso'; there are: base"):
        two(room, left=replace(waffle("left", LEFT), base="torso"))


def test_a_model_that_is_not_mjcf_is_refused_with_mujocos_words(
    room: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    broken = tmp_path_factory.mktemp("robot") / "broken.xml"
    broken.write_text("<mujoco><worldbody><body><geom/></worldbody></mujoco>")
    with pytest.raises(SceneError, match=r"broken\.xml: .*XML"):
        two(room, left=replace(waffle("left", LEFT), model=str(broken)))


def listed(name: str, y: float, **devices: dict[str, object]) -> dict[str, object]:
    """Return a robot as the parameter ``robots`` has it."""
    return {**robots_as_data(**devices)[0], "name": name, "place": {"x": 0.0, "y": y}}


def test_each_robot_has_topics_and_parameters_under_its_name(room: str) -> None:
    with Rig(seed=1) as rig:
        robots = [listed("left", 1.0), listed("right", -1.0, scan={"beams": 90})]
        world = rig.add(World, parameters={"file": room, "robots": robots, "right/scan_rate": 10.0})
        odometry = {name: rig.collect(f"{name}/odometry", Odometry) for name in ("left", "right")}
        scans = {name: rig.collect(f"{name}/scan", LaserScan) for name in ("left", "right")}
        truth = rig.collect("left/ground_truth", GroundTruth)
        for _ in range(10):
            rig.publish("left/velocity", Twist.planar(0.2, 0.0))
            run(rig, world, 0.1)
    assert odometry["left"][-1].pose.x > 0.15
    assert odometry["right"][-1].pose.x == pytest.approx(0.0, abs=0.01)
    assert (odometry["left"][-1].frame, odometry["left"][-1].child_frame) == ("left/odom", "left/base_link")
    assert (len(scans["left"]), len(scans["left"][0].ranges)) == (5, 360)
    assert (len(scans["right"]), len(scans["right"][0].ranges)) == (10, 90)
    assert truth[-1].pose.x == pytest.approx(odometry["left"][-1].pose.x, abs=0.02)


def test_the_event_of_an_empty_battery_names_its_robot(room: str) -> None:
    with Rig(seed=1) as rig:
        world = rig.add(World, parameters={"file": room, "robots": [listed("left", 1.0), listed("right", -1.0)]})
        for energy in (0.0, 10.0):
            rig.publish("right/battery", BatteryState(0.0, energy, 2000.0, energy / 2000.0, 7.0))
            run(rig, world, 0.05)
        found = [event for event in rig.events if event.kind == "world.power"]
    assert [event.details for event in found] == [
        {"robot": "right", "powered": False},
        {"robot": "right", "powered": True},
    ]
    assert all("the robot right" in event.text for event in found)


class Faulty(Device):
    """Raises in one of its methods, from the third tick on."""

    where = Parameter("nowhere", "the method", read_only=True)

    def act(self) -> None:
        self._raise_in("act")

    def watch(self) -> None:
        self._raise_in("watch")

    def tick(self) -> None:
        self._raise_in("tick")

    def sense(self) -> None:
        self._raise_in("sense")

    def colours(self) -> dict[int, Rgb]:
        self._raise_in("colours")
        return {}

    def _raise_in(self, method: str) -> None:
        if method == self.where and self.kit.time > 0.1:
            raise RuntimeError("broken")


def with_faulty(name: str, y: float, where: str) -> dict[str, object]:
    """Return a robot whose first device raises somewhere, as the parameter ``robots`` has it."""
    faulty = {"name": "faulty", "class": f"{__name__}:Faulty", "parameters": {"where": where}}
    found = listed(name, y)
    return {**found, "devices": [faulty, *cast("list[object]", found["devices"])]}


def run_with_faulty(room: str, left: str, right: str = "nowhere") -> tuple[list[bytes], str, list[str]]:
    """Let two robots drive; return all that cameras and the robots' owners get of it, a digest, and the faults."""
    with Rig(seed=1) as rig:
        robots = [with_faulty("left", 1.0, left), with_faulty("right", -1.0, right)]
        world = rig.add(World, parameters={"file": room, "robots": robots})
        got: list[list[Any]] = [rig.collect("world_state", WorldState)]
        for name in ("left", "right"):
            got += [rig.collect(f"{name}/{kind}", cls) for kind, cls in (("scan", LaserScan), (TRUTH, GroundTruth))]
        for _ in range(10):
            rig.publish("right/velocity", Twist.planar(0.2, 0.1))
            rig.clock.advance_to(rig.clock.now() + 50_000_000)
            rig.runtimes["world"].guarded("advance", lambda: world.advance(world.ticks, 0.05))
            rig.settle()
            assert world.simulation.time == pytest.approx(rig.clock.now() / 1e9)
        faults = rig.take_faults()
        return [codec.encode(message) for messages in got for message in messages], world.simulation.digest(), faults


@pytest.mark.parametrize("where", ["act", "watch", "tick", "sense", "colours"])
def test_a_device_that_raises_takes_nothing_from_anybody_and_is_reported_with_its_robot(room: str, where: str) -> None:
    messages, digest, faults = run_with_faulty(room, where)
    assert (messages, digest, []) == run_with_faulty(room, "nowhere")
    assert len(faults) == 8
    assert all("the device 'faulty' of the robot 'left': RuntimeError: broken" in fault for fault in faults)


def test_several_devices_that_raise_are_all_reported(room: str) -> None:
    _, _, faults = run_with_faulty(room, "watch", "sense")
    assert len(faults) == 8
    assert all("robot 'left'" in fault and "robot 'right'" in fault for fault in faults)


@pytest.mark.parametrize(
    ("devices", "complaint"),
    [
        ([{"name": "eye", "class": "regraft.sim_service.devices.lidar:Radar"}], r"devices\.0\.class.*Lidar"),
        ([{"name": "eye", "class": "no_such_module:Eye"}], r"devices\.0\.class.*no_such_module"),
        (
            [{"name": "eye", "class": "regraft.sim_service.devices.lidar:Lidar", "parameters": {"beam": 3}}],
            r"devices\.0\.parameters\.beam.*did you mean 'beams'",
        ),
        (
            [{"name": "eye", "class": "regraft.sim_service.devices.lidar:Lidar", "parameters": {"beams": 0}}],
            r"devices\.0\.parameters\.beams.*must be at least 1",
        ),
        (
            [{"name": name, "class": "regraft.sim_service.devices.lidar:Lidar"} for name in ("front", "rear")],
            r"devices\.1\.connect\.scan.*'front' has the port 'scan' already",
        ),
    ],
)
def test_a_device_that_does_not_fit_is_refused_with_its_place(
    room: str, devices: list[dict[str, object]], complaint: str
) -> None:
    robot = {"name": "", "model": str(WAFFLE), "devices": devices}
    with Rig() as rig, pytest.raises(ParameterError, match=complaint):
        rig.add(World, parameters={"file": room, "robots": [robot]})


@pytest.mark.parametrize(
    ("field", "value"), [("radius", -0.2), ("region", {"x": [0.0, 1.0], "y": [0.0, 1.0], "gap": -0.1})]
)
def test_a_robot_of_less_than_no_size_is_refused_with_its_place(room: str, field: str, value: object) -> None:
    robot = {"name": "", "model": str(WAFFLE), field: value}
    with Rig() as rig, pytest.raises(ParameterError, match=rf"robots\.0\.{field}.*must be at least 0"):
        rig.add(World, parameters={"file": room, "robots": [robot]})


def test_a_lidar_that_measures_farther_at_least_than_at_most_is_refused_with_its_place(room: str) -> None:
    values = {"file": room, "robots": robots_as_data(scan={"range_max": 0.12})}
    with pytest.raises(ParameterError, match=r"robots\.0\.devices\.2: .*range_max: 0\.12 m: must be above range_min"):
        World.check_parameters(parameter_set(World, values).values, 1)


def test_a_schedule_for_a_device_that_is_not_there_is_refused(room: str) -> None:
    fails = [{"at": 1.0, "device": "skan", "failure": "silent"}]
    with Rig() as rig, pytest.raises(ParameterError, match=r"failures\.0\.device.*did you mean 'scan'"):
        rig.add(World, parameters={"file": room, "robots": robots_as_data(), "failures": fails})
