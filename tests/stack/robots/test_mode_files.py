"""A robot may take its modes from a file of ROS 2's system_modes: its names are the robot's own."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.consistency import violations
from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.stack import load
from tests.stack.reading.folders import ROBOT, SINGLE, TWO, at, rovers, told

MODES = """\
drive:
  ros__parameters:
    type: system
    modes:
      __DEFAULT__: {/navigator: inactive, eyes: inactive}
      FAST: {/navigator: active, eyes: active}
      SLOW: {/navigator: active.SLOW, eyes: active}
    rules:
      without_eyes: {if_target: active.FAST, if_part: [eyes, inactive], new_target: active.SLOW}
      while_slow: {if_target: active.FAST, if_part: [/navigator, active.SLOW], new_target: active.SLOW}
/navigator:
  ros__parameters:
    type: node
    modes:
      __DEFAULT__: {ros__parameters: {max_velocity: 0.2}}
      SLOW: {ros__parameters: {max_velocity: 0.1}}
"""
OWN = ROBOT.partition("modes:")[0]
OF_FILE = f"{OWN}modes: modes.yaml\n"
PLANNER = """\
  mode_planner: {class: "regraft.adaptation_manager.planners.modes.mode_planner:ModePlanner"}
  adaptation_manager: {class: "regraft.adaptation_manager.manager:AdaptationManager"}
topics: {adaptations: regraft/AdaptationReport, architecture: regraft/Architecture}
"""


def stack(folder: Path, text: str = TWO + PLANNER, robot: str = OF_FILE, modes: str = MODES) -> Path:
    """Write rovers with a file of modes; return the stack's path."""
    file = rovers(folder, text, robot)
    (folder / "rover" / "modes.yaml").write_text(modes)
    return file


def architecture(folder: Path, text: str = TWO + PLANNER, robot: str = OF_FILE) -> Architecture:
    """Return the architecture of rovers with a file of modes."""
    return load(stack(folder, text, robot)).architecture


def test_each_robot_has_the_modes_of_its_file(tmp_path: Path) -> None:
    found = architecture(tmp_path)
    own = ("drive.__DEFAULT__", "drive.FAST", "drive.SLOW", "navigator.__DEFAULT__", "navigator.SLOW")
    assert set(found.modes) == {f"{robot}/{mode}" for robot in ("left", "right") for mode in own}
    assert found.modes["left/drive.SLOW"] == [
        {"change": "set_parameters", "component": "left.navigator", "parameters": {"max_velocity": 0.1}},
        {"change": "transition", "component": "left.navigator", "transition": "activate"},
        {"change": "transition", "component": "left.eyes", "transition": "activate"},
    ]
    assert found.mode_parts["right/drive.SLOW"] == ("right/navigator.SLOW",)
    assert violations(found) == ()


def test_rules_of_the_file_are_rules_of_each_robot(tmp_path: Path) -> None:
    rules = {rule.name: rule for rule in architecture(tmp_path).mode_rules}
    assert rules["left/drive.without_eyes"] == ModeRule(
        "left/drive.without_eyes", "left.eyes.state == 'inactive'", "left/drive.SLOW", ("left/drive.FAST",)
    )
    assert rules["right/drive.while_slow"].when == "right.navigator.mode == 'right/navigator.SLOW'"


def test_rules_of_the_robot_speak_of_the_modes_of_its_file(tmp_path: Path) -> None:
    robot = f"{OF_FILE}rules:\n  rest: {{when: \"drive.mode == 'drive.SLOW'\", mode: drive.__DEFAULT__}}\n"
    (rule,) = [each for each in architecture(tmp_path, robot=robot).mode_rules if each.name == "left/rest"]
    assert (rule.when, rule.mode) == ("left.drive.mode == 'left/drive.SLOW'", "left/drive.__DEFAULT__")


def test_a_single_robot_has_them_by_their_short_names(tmp_path: Path) -> None:
    found = architecture(tmp_path, SINGLE + PLANNER)
    assert {"drive.FAST", "/navigator.SLOW"} <= set(found.modes)
    assert found.mode_rules[0].when == "eyes.state == 'inactive'"


def test_they_stand_next_to_modes_of_other_robots_and_of_the_stack(tmp_path: Path) -> None:
    use = TWO.replace("{robot: rover, place: {x: 1.0}}", "{robot: rover, place: {x: 1.0}, modes: modes.yaml}")
    (tmp_path / "modes.yaml").write_text(MODES.replace("0.1", "0.05"))
    night = "modes:\n  night: [{change: mode, mode: left/drive.SLOW}, {change: mode, mode: right/slow}]\n"
    found = architecture(tmp_path, f"{use}{PLANNER}{night}", ROBOT)
    assert found.modes["left/navigator.SLOW"][0]["parameters"] == {"max_velocity": 0.05}
    assert found.modes["night"] == [*found.modes["left/drive.SLOW"], *found.modes["right/slow"]]
    assert found.mode_parts["night"] == ("left/drive.SLOW", "right/slow")


def test_a_file_of_the_stack_stands_next_to_those_of_robots(tmp_path: Path) -> None:
    world = "fleet:\n  ros__parameters: {type: system, modes: {__DEFAULT__: {world: active}}}\n"
    (tmp_path / "fleet.yaml").write_text(world)
    for named in ("modes: fleet.yaml\n", "modes: {/: fleet.yaml}\n"):
        found = architecture(tmp_path, f"{TWO}{PLANNER}{named}")
        assert {"fleet.__DEFAULT__", "left/drive.SLOW", "right/drive.SLOW"} <= set(found.modes)


def test_a_mistake_is_found_by_its_line_once_for_all_robots(tmp_path: Path) -> None:
    file = stack(tmp_path, modes=MODES.replace("eyes: inactive", "eys: inactive").replace("0.1", "fast"))
    problems = told(file)
    place = at("rover/modes.yaml", MODES, "__DEFAULT__: {/navigator")
    assert problems[0].startswith(f"{place}drive.modes.__DEFAULT__.eys: there is no part 'eys'; did you mean 'eyes'?")
    value = told(stack(tmp_path, modes=MODES.replace("0.1", "fast")))
    place = at("rover/modes.yaml", MODES, "SLOW: {ros__parameters")
    assert value == [f"{place}/navigator.modes.SLOW.max_velocity: 'fast': must be a number"]


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    assert told(stack(tmp_path, robot=f"{OWN}modes: [slow]\n"))[0] == (
        f"rover/robot.yaml:{len(OWN.splitlines()) + 1}: robots.left.modes: "
        "must be a map, or a file of system_modes, is a list"
    )
    missing = told(stack(tmp_path, robot=f"{OWN}modes: mdes.yaml\n"))
    assert "rover/mdes.yaml: there is no such file" in missing[0]
    (number,) = told(stack(tmp_path, f"{TWO}{PLANNER}modes: {{fleet/: 3}}\n", ROBOT))
    assert number.endswith("modes.fleet/: must be a file of system_modes, is a number")


def test_a_mode_has_one_meaning(tmp_path: Path) -> None:
    twice = "modes:\n  left/drive.FAST: [{change: transition, component: world, transition: deactivate}]\n"
    (problem,) = told(stack(tmp_path, f"{TWO}{PLANNER}{twice}"))
    assert "modes.left/drive.FAST: a file of system_modes has a mode of this name, too" in problem


DIM = "{dim: [{change: set_parameters, component: navigator, parameters: {max_velocity: 0.15}}]}"


@pytest.mark.parametrize(
    ("use", "robot"),
    [
        (f", modes: {DIM}", OF_FILE),
        ("", f"{OWN}modes: {{/: modes.yaml, {DIM[1:]}\n"),
        (", modes: modes.yaml", f"{OWN}modes: {DIM}\n"),
    ],
)
def test_a_robot_has_further_modes_beside_its_file(tmp_path: Path, use: str, robot: str) -> None:
    rule = "rules:\n  rest: {when: \"drive.mode == 'drive.SLOW'\", mode: dim}\n"
    (tmp_path / "modes.yaml").write_text(MODES)
    two = TWO.replace("place: {x: 1.0}", f"place: {{x: 1.0}}{use}")
    found = architecture(tmp_path, two + PLANNER, robot + rule if use == "" else robot)
    assert {"left/dim", "left/drive.SLOW", "left/navigator.SLOW"} <= set(found.modes)
    assert "left/drive.while_slow" in {each.name for each in found.mode_rules}
    if use == "":
        assert {each.when for each in found.mode_rules} >= {"left.drive.mode == 'left/drive.SLOW'"}


def test_a_single_robot_has_further_modes_beside_its_file(tmp_path: Path) -> None:
    single = SINGLE.replace("robot: rover", f"robot: {{robot: rover, modes: {DIM}}}")
    found = architecture(tmp_path, single + PLANNER)
    assert {"dim", "drive.FAST"} <= set(found.modes)
    assert found.mode_rules != ()
