"""A component has its robot's data, whichever robot it is of, without a word in the stack."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import Swap
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.stack import Stack, StackError, apply_overrides, load
from regraft.stack.describing import Surroundings, describe_component
from regraft.stack.successor import successor
from tests.stack.reading.folders import write_all
from tests.support.paths import ROOT

ROBOT = """\
model: rover.xml
parameters: {radius: 0.3, turning_room: 0.4, outline: [], max_velocity: 0.5, max_turn_rate: 0.8, acceleration: 1.0,
             turn_acceleration: 2.0, wheel_speed: 0.6, wheel_separation: 0.4, motion_power: [1.0], range_max: 8.0}
topics:
  odometry: regraft/Odometry
  scan: {type: regraft/LaserScan, sensor_stream: true}
  velocity: regraft/Twist
  map: regraft/OccupancyGrid
components:
  senses:
    command: [senses]
    outputs: {odometry: regraft/Odometry, scan: regraft/LaserScan, map: regraft/OccupancyGrid}
    parameters: {far: 1.0}
  navigator: {class: "regraft.services.navigator.navigator:Navigator"}
"""
SINGLE = """\
system: one
robot: rover
components:
  explorer: {class: "regraft.services.explorer.explorer:Explorer"}
"""
TWO = """\
system: two
robots:
  left: {robot: rover, parameters: {max_velocity: 0.4}}
  right: {robot: rover, components: {navigator: {parameters: {radius: 0.35, max_velocity: 0.1}}}}
"""
CAMERA = "regraft.sim_service.camera_component:Camera"


def stack(folder: Path, text: str, robot: str = ROBOT) -> Stack:
    """Load a stack with the robot ``rover``."""
    file = write_all(folder, stack=text, rover_robot=robot)
    (folder / "rover" / "rover.xml").write_text("<mujoco/>")
    return load(file)


def refusal(folder: Path, text: str, robot: str = ROBOT) -> str:
    """Return what is wrong with a stack."""
    with pytest.raises(StackError) as refused:
        stack(folder, text, robot)
    return str(refused.value).replace(f"{folder}/", "")


def test_components_of_the_single_robot_and_of_the_stack_have_its_data(tmp_path: Path) -> None:
    components = stack(tmp_path, SINGLE).architecture.components
    assert components["explorer"].parameters == {"radius": 0.3, "turning_room": 0.4, "range_max": 8.0}
    navigator = components["navigator"].parameters
    assert navigator["outline"] == []
    assert (navigator["max_velocity"], navigator["velocity_limit"], navigator["turn_rate_limit"]) == (0.5, 0.5, 0.8)


def test_each_of_several_robots_has_its_own_and_what_a_use_sets_stays(tmp_path: Path) -> None:
    components = stack(tmp_path, TWO).architecture.components
    left, right = (components[f"{robot}.navigator"].parameters for robot in ("left", "right"))
    assert (left["radius"], left["max_velocity"], left["velocity_limit"]) == (0.3, 0.4, 0.4)
    assert (right["radius"], right["max_velocity"], right["velocity_limit"]) == (0.35, 0.1, 0.5)


def test_a_limit_is_the_robots_and_keeps_the_default(tmp_path: Path) -> None:
    found = stack(tmp_path, SINGLE)
    description = found.architecture.components["navigator"].description
    assert description is not None
    turning = description.parameter("max_turn_rate")
    assert turning is not None
    assert (turning.default, turning.schema["maximum"]) == (0.8, 0.8)
    apply_overrides(found, ["navigator.max_velocity=0.5"])
    with pytest.raises(StackError, match=r"0\.51: must be at most 0\.5 m/s"):
        apply_overrides(found, ["navigator.max_velocity=0.51"])


PURSUIT = "class: 'regraft.services.navigator.pursuit_navigator:PursuitNavigator', parameters: {max_velocity: SPEED}"
SWAPPED = f"{{change: swap, component: navigator, {PURSUIT}}}"
ADDED = f"{{change: add, component: spare, spec: {{{PURSUIT}}}}}"
ADDED_TO_RIGHT = ADDED.replace("spare", "right.spare")


@pytest.mark.parametrize(
    ("text", "change", "place"),
    [(SINGLE, SWAPPED, "parameters"), (SINGLE, ADDED, "spec.parameters"), (TWO, ADDED_TO_RIGHT, "spec.parameters")],
)
def test_a_class_that_a_mode_gives_has_the_limits_of_its_robot(
    tmp_path: Path, text: str, change: str, place: str
) -> None:
    mode = f"{text}modes:\n  quick:\n    - {change}\n"
    assert list(stack(tmp_path, mode.replace("SPEED", "0.4")).architecture.modes) == ["quick"]
    told = f"stack.yaml:{mode.count(chr(10))}: modes.quick.0.{place}.max_velocity: 0.51: must be at most 0.5 m/s"
    assert told in refusal(tmp_path, mode.replace("SPEED", "0.51"))


def test_a_class_that_a_mode_adds_drives_no_faster_than_a_slow_robot(tmp_path: Path) -> None:
    mode = f"{SINGLE}modes:\n  quick:\n    - {ADDED.replace('SPEED', '0.2')}\n"
    slow = ROBOT.replace("max_velocity: 0.5", "max_velocity: 0.1")
    assert "0.2: must be at most 0.1 m/s" in refusal(tmp_path, mode, slow)


def test_a_successor_has_the_data_that_its_class_alone_takes(tmp_path: Path) -> None:
    spare = "components:\n  spare: {class: 'tests.estimation.parts:Source', parameters: {rate: 5.0}}\n"
    loaded = stack(tmp_path, f"system: one\nrobot: rover\n{spare}topics: {{made: regraft/Twist}}\n")
    old, surroundings = loaded.architecture.components["spare"], Surroundings(tmp_path, "/run", loaded.references)
    change = Swap("spare", "tests.estimation.parts:Round", {"largest": 0.4})
    wanted = replace(old, cls=change.cls, parameters=old.parameters | change.parameters, description=None)
    described = describe_component(wanted, surroundings).spec
    assert successor(change, old, described, loaded.architecture).parameters == {"radius": 0.3, "largest": 0.4}


@pytest.mark.parametrize(("text", "name"), [(TWO, "right"), (SINGLE, "")])
def test_an_added_component_may_refer_to_its_robots_name_and_have_texts_that_look_like_it(
    tmp_path: Path, text: str, name: str
) -> None:
    surroundings = Surroundings(tmp_path, "/run", stack(tmp_path, text).references)
    given = {"robot": "$robot", "camera": "$$robot"}
    eye = ComponentSpec(f"{name}.eye".removeprefix("."), CAMERA, parameters=given)
    assert describe_component(eye, surroundings).spec.parameters == {"robot": name, "camera": "$robot"}


def test_a_robot_that_lacks_what_a_component_takes_is_refused_by_its_file(tmp_path: Path) -> None:
    told = refusal(tmp_path, SINGLE, ROBOT.replace("turning_room: 0.4", "turning_rom: 0.4"))
    expected = (
        "rover/robot.yaml:1: components.explorer.parameters.turning_room: comes from the robot, which has no parameter "
        "'turning_room': add it to robot.parameters, or set it here; did you mean 'turning_rom'?"
    )
    assert expected in told
    assert "components.navigator.parameters.turning_room" in told


EXPLORER, NAVIGATOR = "components.explorer.parameters", "components.navigator.parameters"


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        ("radius: 0.3", "radius: wide", f":2: {EXPLORER}.radius: 'wide': must be a number"),
        ("outline: []", "outline: [0.1]", f":2: {NAVIGATOR}.outline: [0.1]: must be [ahead"),
        ("range_max: 8.0", "range_max: 0", f":3: {EXPLORER}.range_max: 0: must be at least 0.01 m"),
    ],
)
def test_wrong_data_are_refused_where_the_robots_file_has_them(
    tmp_path: Path, right: str, wrong: str, told: str
) -> None:
    assert f"rover/robot.yaml{told}" in refusal(tmp_path, SINGLE, ROBOT.replace(right, wrong))


def test_a_stack_refers_to_the_data_of_its_single_robot(tmp_path: Path) -> None:
    text = SINGLE.replace(
        "robot: rover\n", "robot: {robot: rover, components: {senses: {parameters: {far: $range_max}}}}\n"
    )
    lamps = "  lamps: {command: [lamps], parameters: {far: $range_max}}\n"
    components = stack(tmp_path, text + lamps).architecture.components
    assert components["senses"].parameters == components["lamps"].parameters == {"far": 8.0}


def test_without_a_robot_a_component_is_as_its_class_says(tmp_path: Path) -> None:
    text = SINGLE.replace("robot: rover\n", "topics: {map: regraft/OccupancyGrid, odometry: regraft/Odometry}\n")
    senses = "  senses: {command: [senses], outputs: {odometry: regraft/Odometry, map: regraft/OccupancyGrid}}\n"
    assert stack(tmp_path, text + senses).architecture.components["explorer"].parameters == {}


def test_the_waffles_file_and_the_defaults_of_components_agree(tmp_path: Path) -> None:
    text = "include: [frog]\n".replace("frog", str(ROOT / "regraft/stacks/frog/search.yaml"))
    components = stack(tmp_path, text).architecture.components
    for name in ("navigator", "explorer", "obstacles", "docking", "mapper", "localizer", "detector", "sensor_monitor"):
        description = components[name].description
        assert description is not None
        given = {each.name: each.default for each in description.parameters if each.name in components[name].parameters}
        robots = {each: value for each, value in components[name].parameters.items() if each in DATA}
        assert robots
        assert {each: given[each] for each in robots} == robots


DATA = (
    "radius", "turning_room", "room", "outline", "max_velocity", "velocity_limit", "turn_rate_limit", "acceleration",
    "turn_acceleration", "wheel_speed", "wheel_separation", "base_height", "range_max", "motion_power", "consumers",
)  # fmt: skip
