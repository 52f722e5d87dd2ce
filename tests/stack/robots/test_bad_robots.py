"""Robots and worlds that cannot be are refused before anything starts, with file and line."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regraft.stack import load
from tests.cli.app import whole
from tests.support.worlds import WAFFLE

STACK = """\
system: pair
clock: simulated
world: room.xml
robots:
  left: {robot: rover, place: {x: 1.0, y: 0.0}}
  right: {robot: rover, place: {x: -1.0, y: 0.0}}
topics:
  world_state: {type: regraft/WorldState, rate: 20}
components:
  world:
    class: "regraft.sim_service.world:World"
    parameters: {file: $world, robots: $robots}
"""
ROBOT = """\
model: rover.xml
radius: 0.22
devices:
  drive: {class: "regraft.sim_service.devices.drive:DifferentialDrive"}
  scan: {class: "regraft.sim_service.devices.lidar:Lidar"}
topics:
  velocity: regraft/Twist
  scan: {type: regraft/LaserScan, sensor_stream: true}
  ground_truth: regraft/GroundTruth
"""
ROOM = '<mujoco><worldbody><geom name="floor" type="plane" size="5 5 .1"/></worldbody></mujoco>'
BROKEN = """\
from regraft.sim_service.devices.core.device import Device


class Broken(Device):
    def {method}(self, *given):
        raise RuntimeError("out of order")
"""
NOSE = """\
from regraft import Output
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.sim_service.devices.core.sensor import Sensor


class Nose(Sensor):
    measures = "smell"
    smell = Output(LightLevel, required=False)

    def measure(self):
        raise RuntimeError("it has a cold")
"""
EAR = """\
from regraft import Input, Output
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.sim_service.devices.core.device import Device


class Ear(Device):
    light = Input(LightLevel, keep=10, required=False)
    dark = Input(LightLevel, required=False)
    heard = Output(LightLevel, required=False)

    def act(self):
        found = {use}
        assert found == {found!r}, repr(found)
"""


def refused(folder: Path, stack: str = STACK, robot: str = ROBOT, model: str = "", device: str = "") -> str:
    """Return what is said of a stack that is wrong, with short paths."""
    code, output = checked(folder, stack, robot, model, device)
    assert code == 2, output
    return output


def checked(folder: Path, stack: str = STACK, robot: str = ROBOT, model: str = "", device: str = "") -> tuple[int, str]:
    """Return the exit code of the check of a stack, and what is said of it, with short paths."""
    rover = folder / "rover"
    rover.mkdir()
    (folder / "room.xml").write_text(ROOM)
    (folder / "stack.yaml").write_text(stack)
    (rover / "robot.yaml").write_text(robot)
    (rover / "rover.xml").write_text(model or WAFFLE.read_text())
    if device:
        (rover / f"{folder.name}_parts.py").write_text(device)
    done = CliRunner().invoke(whole(), ["stack", "check", str(folder / "stack.yaml")])
    shutil.rmtree(rover)
    return done.exit_code, done.output.replace(f"{folder}/", "")


def test_a_robot_without_its_body_is_refused_with_those_that_there_are(tmp_path: Path) -> None:
    model = WAFFLE.read_text().replace('name="base"', 'name="bse"', 1)
    found = refused(tmp_path, model=model)
    assert "stack.yaml:10: components.world: rover/rover.xml: the robot 'left' has no body 'base'; there" in found


def test_two_robots_in_one_place_are_refused_with_their_distance(tmp_path: Path) -> None:
    found = refused(tmp_path, STACK.replace("-1.0", "0.9"))
    assert "'left' and 'right' stand 0.10 m apart: must be at least 0.44 m" in found


def test_a_name_used_twice_is_refused(tmp_path: Path) -> None:
    found = refused(tmp_path, STACK.replace("right:", "left:"))
    assert "stack.yaml:6: robots.left: is given twice, first in line 5" in found


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('Lidar"}', 'Lidar", parameters: {site: nose}}', "5: .*no site named 'left/nose'; there are: left/lidar"),
        (
            'Drive"}',
            'Drive", parameters: {left_wheel: left}}',
            "4: .*no joint named 'left/left'; there are: left",
        ),
        ('Lidar"}', 'Lidr"}', "5: .*is no subclass of Device; did you mean 'Lidar'"),
        ("devices.lidar:", "devices.lidr:", "5: .*did you mean 'regraft.sim_service.devices.lidar'"),
        ('Lidar"}', 'Lidar", parameters: {beems: 3}}', "5: .*Lidar has no such parameter; did you mean 'beams'"),
        ('Lidar"}', 'Lidar", parameters: {beams: 0}}', "5: .*beams: 0: must be at least 1"),
        ('Drive"}', 'Drive", connect: {velocity: velocty}}', "4: .*'left/velocty'.*did you mean 'left/velocity'"),
        ('Drive"}', 'Drive", connect: {velocity: /stop}}', "4: .*'stop'"),
    ],
)
def test_a_device_that_does_not_fit_is_refused_in_the_robots_file(
    tmp_path: Path, old: str, new: str, problem: str
) -> None:
    assert re.search(f"rover/robot.yaml:{problem}", refused(tmp_path, robot=ROBOT.replace(old, new)))


def test_a_model_that_mujoco_refuses_is_named_with_mujocos_message(tmp_path: Path) -> None:
    found = refused(tmp_path, model="<mujoco><worldbody><body></worldbody></mujoco>")
    assert "stack.yaml:10: components.world: rover/rover.xml: XML parse error" in found


@pytest.mark.parametrize(
    "method", ["build", "act", "watch", "tick", "sense", "snapshot", "colours", "truth", "evaluate"]
)
def test_a_device_that_raises_is_named_before_anything_starts(tmp_path: Path, method: str) -> None:
    robot = ROBOT.replace("devices:\n", f'devices:\n  wings: {{class: "{tmp_path.name}_parts:Broken"}}\n')
    found = refused(tmp_path, robot=robot, device=BROKEN.format(method=method))
    assert "rover/robot.yaml:4: " in found
    assert "the device 'wings' of the robot 'left': RuntimeError: out of order" in found


@pytest.mark.parametrize(
    ("failure", "problem"),
    [
        (
            "{at: 1, device: left/scn, failure: silent}",
            "there is no device 'left/scn' that can fail; did you mean",
        ),
        ("{at: 1, device: left/scan, failure: loud}", "'loud': left/scan can fail as one of: none, silent, frozen"),
        ("{at: 1, device: left/drive, failure: silent}", "there is no device 'left/drive' that can fail"),
    ],
)
def test_a_failure_of_a_device_that_is_not_there_is_refused(tmp_path: Path, failure: str, problem: str) -> None:
    found = refused(tmp_path, STACK.replace("robots: $robots}", f"robots: $robots, failures: [{failure}]}}"))
    assert (
        f"stack.yaml:12: components.world.parameters.failures.0.{'failure' if 'loud' in failure else 'device'}" in found
    )
    assert problem in found


def test_a_sensor_that_cannot_measure_is_named_whatever_its_rate(tmp_path: Path) -> None:
    robot = ROBOT.replace(
        "devices:\n", f'devices:\n  nose: {{class: "{tmp_path.name}_parts:Nose", parameters: {{rate: 0.5}}}}\n'
    )
    found = refused(tmp_path, robot=robot, device=NOSE)
    assert "rover/robot.yaml:4: " in found
    assert "the device 'nose' of the robot 'left': RuntimeError: it has a cold" in found


def test_a_device_may_do_with_its_ports_what_a_component_may(tmp_path: Path) -> None:
    robot = ROBOT.replace("devices:\n", f'devices:\n  ear: {{class: "{tmp_path.name}_parts:Ear"}}\n')
    alone = STACK.replace("  right:", "  # right:")
    light, heard = "self.light", "self.heard"
    read = (f"{light}.latest", f"{light}.opener()", f"{light}.envelope", f"{light}.stamp", f"{light}.take()")
    use = ", ".join((*read, f"{light}.next().done", f"{light}.name", f"{light}.key", f"{heard}.name", f"{heard}.key"))
    found: tuple[object, ...] = (None, None, None, None, [], False, "left/light", "", "left/heard", "")
    code, output = checked(tmp_path, alone, robot, device=EAR.format(use=use, found=found))
    assert code == 0, output


def test_a_device_that_takes_from_an_input_that_keeps_nothing_is_refused(tmp_path: Path) -> None:
    robot = ROBOT.replace("devices:\n", f'devices:\n  ear: {{class: "{tmp_path.name}_parts:Ear"}}\n')
    device = EAR.format(use="self.dark.take()", found=[])
    assert "the input 'left/dark' keeps nothing to take" in refused(tmp_path, robot=robot, device=device)


def test_a_value_that_the_stack_gives_a_device_is_checked(tmp_path: Path) -> None:
    found = refused(tmp_path, STACK.replace("robots: $robots}", "robots: $robots, left/scan_site: nose}"))
    assert re.search("rover/robot.yaml:5: .*no site named 'left/nose'; there are: left/lidar", found)


def test_a_device_may_be_complete_by_values_of_the_stack_alone(tmp_path: Path) -> None:
    robot = ROBOT.replace('Lidar"}', 'Lidar", parameters: {site: nose}}')
    given = "left/scan_site: lidar, right/scan_site: lidar}"
    code, output = checked(tmp_path, STACK.replace("robots: $robots}", f"robots: $robots, {given}"), robot)
    assert code == 0, output


def test_a_devices_shared_topic_is_the_same_for_all_robots(tmp_path: Path) -> None:
    rover = tmp_path / "rover"
    rover.mkdir()
    (tmp_path / "room.xml").write_text(ROOM)
    (tmp_path / "stack.yaml").write_text(STACK.replace("topics:\n", "topics:\n  stop: regraft/Twist\n"))
    (rover / "robot.yaml").write_text(ROBOT.replace('Drive"}', 'Drive", connect: {velocity: /stop}}'))
    (rover / "rover.xml").write_text(WAFFLE.read_text())
    world = load(tmp_path / "stack.yaml").architecture.components["world"]
    assert world.connections["stop"] == "stop"
    assert "left/velocity" not in world.connections
