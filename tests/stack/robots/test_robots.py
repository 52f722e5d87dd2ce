"""A robot is written once, and used in any stack under any name."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.architecture import ConstraintKind
from regraft.bus_schema.model.consistency import violations
from regraft.bus_schema.model.robots.robot_view import robots_of
from regraft.stack import load
from tests.stack.reading.folders import ROBOT, SINGLE, TWO, at, rovers, told

SIGNALS = """\
  signals:
    class: tests.stack.parts:Signals
    parameters: {horn: $horn}
    services: {honk: /honk}
"""
SHARED = ROBOT.replace("topics:\n", "topics:\n  /clock_like: regraft/Twist\n")


def test_two_of_a_kind_have_names_of_their_own(tmp_path: Path) -> None:
    architecture = load(rovers(tmp_path)).architecture
    assert list(architecture.components) == ["world", "left.eyes", "left.navigator", "right.eyes", "right.navigator"]
    assert set(architecture.topics) == {f"{r}/{t}" for r in ("left", "right") for t in ("odometry", "scan", "velocity")}
    left = architecture.components["left.navigator"]
    assert left.connections == {name: f"left/{name}" for name in ("odometry", "scan", "velocity")}
    assert left.services == {"navigate_to": "left/navigate_to"}
    assert violations(architecture) == ()


def test_the_single_robot_keeps_short_names(tmp_path: Path) -> None:
    architecture = load(rovers(tmp_path, SINGLE)).architecture
    assert list(architecture.components) == ["world", "eyes", "navigator"]
    assert set(architecture.topics) == {"odometry", "scan", "velocity"}
    assert architecture.components["navigator"].services == {"navigate_to": "navigate_to"}
    assert set(architecture.modes) == {"slow"}
    assert architecture.components["world"].parameters["robots"][0]["name"] == ""


def test_one_robot_can_be_single_beside_others_and_is_first(tmp_path: Path) -> None:
    both = TWO + "robot: {robot: rover/robot.yaml, parameters: {speed: 0.05}}\n"
    architecture = load(rovers(tmp_path, both)).architecture
    assert {"navigator", "left.navigator", "right.navigator"} <= set(architecture.components)
    assert [robot["name"] for robot in architecture.components["world"].parameters["robots"]] == ["", "left", "right"]
    assert architecture.components["navigator"].parameters == {"max_velocity": 0.05}


def test_null_removes_the_robots_of_an_included_stack_and_leaves_the_single_one(tmp_path: Path) -> None:
    base = TWO + "robot: rover\n"
    architecture = load(rovers(tmp_path, "include: [base.yaml]\nrobots: null\n", base=base)).architecture
    assert list(architecture.components) == ["world", "eyes", "navigator"]
    assert [robot["name"] for robot in architecture.components["world"].parameters["robots"]] == [""]


def test_a_use_changes_parameters_devices_and_components(tmp_path: Path) -> None:
    uses = "robots:\n  left: {robot: rover, parameters: {speed: 0.1}, components: {navigator: {restart: never}}}\n"
    text = f"{TWO.partition('robots:')[0]}{uses}components:{TWO.partition('components:')[2]}"
    navigator = load(rovers(tmp_path, text)).architecture.components["left.navigator"]
    assert navigator.parameters == {"max_velocity": 0.1}
    assert navigator.restart.when.value == "never"


def test_worlds_take_the_robots_with_models_places_and_devices(tmp_path: Path) -> None:
    world = load(rovers(tmp_path)).architecture.components["world"].parameters
    assert world["file"] == str(tmp_path / "room.xml")
    model = str(tmp_path / "rover" / "rover.xml")
    assert world["robots"] == [
        {
            "name": "left",
            "model": model,
            "place": {"x": 1.0},
            "devices": [
                {"name": "drive", "class": "devices:Drive", "parameters": {"limit": 0.2}},
                {"name": "lidar", "class": "devices:Lidar", "parameters": {"beams": 90}},
            ],
        },
        {
            "name": "right",
            "model": model,
            "devices": [
                {"name": "drive", "class": "devices:Drive", "parameters": {"limit": 0.1}},
                {"name": "lidar", "class": "devices:Lidar", "parameters": {"beams": 30}},
            ],
        },
    ]


def test_modes_and_constraints_speak_of_the_robots_own(tmp_path: Path) -> None:
    robot = ROBOT.replace(
        "modes:\n",
        "  - {require: 'navigator.max_velocity * 2 < 1 and not (eyes.active and world.active and 1 < 0)'}\n"
        "  - {at_least_one_active: [navigator, /world]}\n"
        "  - {provided: [navigate_to]}\n"
        "modes:\n",
    ).replace(
        "parameters: {max_velocity: 0.1}}\n",
        "parameters: {max_velocity: 0.1}}\n    - {change: connect, component: eyes, port: scan, topic: scan}\n",
    )
    architecture = load(rovers(tmp_path, robot=robot)).architecture
    limit, require, active, provided = architecture.constraints[:4]
    assert limit.parameter == "left.navigator.max_velocity"
    assert require.expression == (
        "left.navigator.max_velocity * 2 < 1 and not (left.eyes.active and world.active and 1 < 0)"
    )
    assert active.components == ("left.navigator", "world")
    assert (provided.kind, provided.services) == (ConstraintKind.PROVIDED, ("left/navigate_to",))
    assert architecture.modes["right/slow"] == [
        {"change": "set_parameters", "component": "right.navigator", "parameters": {"max_velocity": 0.1}},
        {"change": "connect", "component": "right.eyes", "port": "scan", "topic": "right/scan"},
    ]


def test_paths_in_a_mode_are_looked_for_from_the_files_that_have_them(tmp_path: Path) -> None:
    horn = '{class: "tests.stack.parts:Signals", connect: {clock_like: null}, parameters: {horn: new.wav}}'
    modes = (
        "    - {change: set_parameters, component: signals, parameters: {horn: $horn}}\n"
        f"    - {{change: add, component: second, spec: {horn}}}\n"
        "  loud:\n"
        "    - {change: swap, component: signals, parameters: {horn: loud.wav}}\n"
    )
    use = "parameters: {speed: 0.1, horn: mine.wav}"
    signals = SIGNALS.replace("    services: {honk: /honk}\n", "")
    robot = SHARED.replace("constraints:\n", f"{signals}constraints:\n") + modes
    architecture = load(rovers(tmp_path, TWO.replace("parameters: {speed: 0.1}", use), robot)).architecture
    assert architecture.components["right.signals"].parameters["horn"] == str(tmp_path / "mine.wav")
    for name, horn in (("left", "rover/sounds/horn.wav"), ("right", "mine.wav")):
        _, changed, added = architecture.modes[f"{name}/slow"]
        assert changed["parameters"] == {"horn": str(tmp_path / horn)}
        assert added["spec"]["parameters"] == {"horn": str(tmp_path / "rover" / "new.wav")}
        (swapped,) = architecture.modes[f"{name}/loud"]
        assert swapped["parameters"] == {"horn": str(tmp_path / "rover" / "loud.wav")}


def test_what_begins_with_a_slash_is_shared_by_all(tmp_path: Path) -> None:
    robot = SHARED.replace("constraints:\n", f"{SIGNALS}constraints:\n")
    one = TWO.replace("  right: ", "  # right: ")
    left = load(rovers(tmp_path, one, robot)).architecture
    assert "clock_like" in left.topics
    assert left.components["left.signals"].connections == {"clock_like": "clock_like"}
    assert left.components["left.signals"].services == {"honk": "honk"}
    assert left.components["left.signals"].parameters == {"horn": str(tmp_path / "rover" / "sounds" / "horn.wav")}
    single = load(rovers(tmp_path, SINGLE, robot)).architecture
    assert single.components["signals"].connections == {"clock_like": "clock_like"}


@pytest.mark.parametrize("own", ["", "topics: {clock_like: {type: regraft/Twist}}\n"])
def test_robots_and_the_stack_may_name_the_same_shared_topic(tmp_path: Path, own: str) -> None:
    architecture = load(rovers(tmp_path, TWO + own, SHARED)).architecture
    assert architecture.topics["clock_like"].type == "regraft/Twist"


HORNS = """\
model: rover.xml
topics: {/clock_like: regraft/Twist}
components:
  signals: {class: "tests.stack.parts:Signals"}
constraints:
  - {provided: [honk]}
"""


def test_a_robot_without_topics_of_its_own_has_names_of_its_own(tmp_path: Path) -> None:
    architecture = load(
        rovers(
            tmp_path, TWO.replace(", parameters: {speed: 0.1}, devices: {lidar: {parameters: {beams: 30}}}", ""), HORNS
        )
    ).architecture
    for robot in ("left", "right"):
        assert architecture.components[f"{robot}.signals"].services == {"honk": f"{robot}/honk"}
    assert [constraint.services for constraint in architecture.constraints] == [("left/honk",), ("right/honk",)]
    assert robots_of(architecture.components, architecture.scopes) == {"left", "right"}
    assert violations(architecture) == ()


def test_a_robot_may_include_another_and_a_stack_may_change_the_robots_of_its_base(tmp_path: Path) -> None:
    blind = (
        "include: [../rover/robot.yaml]\n"
        "components: {eyes: {state: inactive}, navigator: null}\n"
        "constraints: []\nmodes: {slow: null}\n"
    )
    over = (
        "include: [base.yaml]\nrobots:\n  left: {robot: blind}\n"
        "  right: {place: {y: 2.0}, components: {eyes: {restart: never}}}\n"
    )
    path = rovers(tmp_path, over, base=TWO, blind_robot=blind)
    architecture = load(path).architecture
    assert set(architecture.components) == {"world", "left.eyes", "right.eyes", "right.navigator"}
    left, right = architecture.components["world"].parameters["robots"]
    assert (left["place"], right["place"]) == ({"x": 1.0}, {"y": 2.0})
    assert left["model"] == str(tmp_path / "rover" / "rover.xml")
    assert right["devices"][1]["parameters"] == {"beams": 30}


def test_a_wrong_setting_of_a_device_is_told_in_the_robots_file(tmp_path: Path) -> None:
    robot = ROBOT.replace("{beams: $beams}", "{beams: 0}")
    lines = told(rovers(tmp_path, SINGLE, robot))
    field = "components.world.parameters.robots.0.devices.1.parameters.beams"
    assert lines == [at("rover/robot.yaml", robot, "lidar:") + f"{field}: 0: must be at least 1"]
    (line,) = told(rovers(tmp_path, TWO.replace("{beams: 30}", "{beams: 0}")))
    assert line == at("stack.yaml", TWO, "right:") + f"{field.replace('robots.0', 'robots.1')}: 0: must be at least 1"


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("{speed: 0.1}", "{sped: 0.1}", "6: robots.right.parameters.sped: there is no parameter 'sped' to change; did"),
        ("{lidar: {", "{lidr: {", "6: robots.right.devices.lidr: there is no device 'lidr' to change, and a new one"),
        ("devices: {", "components: {eys: ~}, devices: {", "6: robots.right.components.eys: there is no component"),
        ("devices: {", "wheels: 3, devices: {", "6: robots.right.wheels: there is no such field; there are: "),
        ("{x: 1.0}", "3", "5: robots.left.place: must be a map with x and y, is a number"),
        (
            "robot: rover, place",
            "place",
            "5: robots.left: there is no such robot to change, and a new one needs 'robot'",
        ),
        (
            "robot: rover, place",
            "robot: rovr, place",
            "5: robots.left.robot: 'rovr': there is no such file; did you mean",
        ),
        (
            "robot: rover, place",
            "robot: wafle, place",
            "5: robots.left.robot: 'wafle': there is no such file; did you mean 'waffle'?",
        ),
        (
            "robot: rover, place",
            "robot: zeppelin, place",
            "5: robots.left.robot: 'zeppelin': there is no such file; installed robots: patroller, waffle",
        ),
        ("  left:", "  world:", "5: robots.world: a component has this name too, at "),
        ("  left:", "  a.b:", "5: robots.a.b: 'a.b' cannot name a robot"),
        ("  left:", "  right:", "6: robots.right: is given twice, first in line 5: leave one out"),
        (
            "  world: {",
            "  left.eyes: {",
            "8: components.left.eyes: robot 'left' has this name too, at rover/robot.yaml:11",
        ),
        ("world: room.xml", "world: rom.xml", "3: world: 'rom.xml': there is no such file; did you mean "),
        ("robots:\n", "robot: 3\nrobots:\n", "4: robot: must be a map, or the folder or file of a robot, is a number"),
    ],
)
def test_a_wrong_use_is_refused_in_the_stack_file(tmp_path: Path, old: str, new: str, problem: str) -> None:
    assert TWO.count(old) == 1
    lines = told(rovers(tmp_path, TWO.replace(old, new)))
    assert any(line.startswith(f"stack.yaml:{problem}") for line in lines), lines


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("model: rover.xml\n", "", "1: robots.left: has no 'model': must name the robot's MJCF file"),
        ("rover.xml", "rver.xml", "1: robots.left.model: 'rver.xml': there is no such file; did you mean"),
        ("topics:", "topcs:", "6: topcs: there is no such field; did you mean 'topics'?"),
        ("constraints:", "system: a\nconstraints:", "15: system: there is no such field; there are: "),
        (
            '{class: "devices:Drive", p',
            "{p",
            "4: robots.left.devices.drive: has no 'class': must name one as module:Class",
        ),
        (
            "parameters: {limit: $speed}",
            "sets: 3",
            "4: robots.left.devices.drive.sets: there is no such field; there are: class, connect, parameters",
        ),
        ("{limit: $speed}", "[3]", "4: robots.left.devices.drive.parameters: must be a map, is a list"),
        ("speed: 0.2", "robot: 0.2", "2: robots.left.parameters.robot: 'robot' cannot name a parameter of a robot"),
        ("speed: 0.2", "RUN: 0.2", "2: robots.left.parameters.RUN: 'RUN' cannot name a parameter of a robot"),
    ],
)
def test_a_wrong_robot_is_refused_in_its_own_file(tmp_path: Path, old: str, new: str, problem: str) -> None:
    assert ROBOT.count(old) == 1
    lines = told(rovers(tmp_path, robot=ROBOT.replace(old, new)))
    assert any(line.startswith(f"rover/robot.yaml:{problem}") for line in lines), lines


@pytest.mark.parametrize("own", ["", "parameters:\n", "parameters: {}\n"])
def test_a_parameter_that_a_robot_without_parameters_lacks_is_refused(tmp_path: Path, own: str) -> None:
    (line,) = told(
        rovers(
            tmp_path,
            TWO.replace("place: {x: 1.0}", "parameters: {raduis: 0.3}").replace("speed: 0.1", ""),
            f"model: rover.xml\n{own}devices: {{lidar: {{class: 'devices:Lidar'}}}}\n",
        )
    )
    assert line.startswith("stack.yaml:5: robots.left.parameters.raduis: there is no parameter 'raduis' to change")


def test_a_robot_without_a_file_is_refused(tmp_path: Path) -> None:
    path = rovers(tmp_path)
    (tmp_path / "rover" / "robot.yaml").unlink()
    assert "robots.left.robot: 'rover': there is no such file" in told(path)[0]


@pytest.mark.parametrize("name", ["left-bot", "2nd", "in"])
def test_a_name_that_has_no_place_in_the_robots_own_expressions_is_refused_where_it_is_given(
    tmp_path: Path, name: str
) -> None:
    robots = TWO.replace("  left:", f"  {name}:")
    assert f"{name}.navigator" in load(rovers(tmp_path, robots)).architecture.components
    speaks = ROBOT.replace("modes:\n", "  - {require: navigator.max_velocity < 0.3}\nmodes:\n")
    (line,) = told(rovers(tmp_path, robots, speaks))
    assert line.startswith(f"stack.yaml:5: robots.{name}: '{name}' has no place in expressions, and rover/robot.yaml")
    other = ROBOT.replace("modes:\n", "  - {require: world.tick_rate < 300}\nmodes:\n")
    load(rovers(tmp_path, robots, other))


def test_a_name_that_no_file_can_have_is_refused_as_a_robot(tmp_path: Path) -> None:
    (line,) = told(rovers(tmp_path, SINGLE.replace("robot: rover", f"robot: {300 * 'a'}")))
    assert line.startswith("stack.yaml:4: robot.robot: ")


def test_a_robot_that_includes_itself_is_refused(tmp_path: Path) -> None:
    (line,) = told(rovers(tmp_path, SINGLE, f"include: [robot.yaml]\n{ROBOT}"))
    chain = "rover/robot.yaml > rover/robot.yaml"
    assert line == f"rover/robot.yaml:1: include.0: 'robot.yaml' includes itself: {chain}"


def test_the_robots_of_a_stack_are_bounded_together(tmp_path: Path) -> None:
    many = "".join(f"  r{number}: {{robot: rover}}\n" for number in range(900))
    text = f"{TWO.partition('robots:')[0]}robots:\n{many}components:{TWO.partition('components:')[2]}"
    (line,) = told(rovers(tmp_path, text))
    assert line == "stack.yaml: holds more than 20000 values with all its robots"
