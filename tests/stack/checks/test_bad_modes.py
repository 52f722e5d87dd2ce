"""Modes are checked with the stack, in all that they set and connect: each mistake in its own line, and once."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.stack import load
from regraft.stack.yaml.problems import Problem
from tests.modes.stacks import MODES, RULES, STACK
from tests.stack.reading.files import GOOD, line_of, problems, problems_of, write
from tests.stack.reading.folders import ROBOT, TWO, rovers

N = "component: rescuer.navigator"
SET = f"""\
modes:
  night:
    - {{change: transition, component: rescuer.navigator, transition: activate}}
    - change: set_parameters
      {N}
      parameters:
        planner: straight
        max_velocity: 0.1
"""
AGAIN = f"modes:\n  night:\n    - {{change: swap, {N}, connect: {{odometry: truth}}}}\n"
CONNECT = f"modes:\n  night:\n    - {{change: connect, {N}, port: odometry, topic: truth}}\n"
SWAP = (
    f"modes:\n  night:\n    - {{change: swap, {N}, class: 'tests.stack.parts:Joystick', parameters: {{layout: ''}}}}\n"
)
ADD = "modes:\n  night:\n    - {change: add, component: stick, spec: {class: 'tests.stack.parts:Navigator', "
ADD += "parameters: {careful: true}}}\n"
MOVE = f"hosts: [edge]\nmodes:\n  night:\n    - {{change: move, {N}, host: edge}}\n"
REMOVE = f"hosts: [edge]\nmodes:\n  night:\n    - {{change: remove, {N}, topics: [truth]}}\n"


def _told(found: Problem) -> tuple[str, int | None]:
    return found.field, found.line


@pytest.mark.parametrize("mode", [SET, CONNECT, AGAIN, SWAP, ADD, MOVE, MOVE.partition("\n")[2], REMOVE])
def test_a_mode_whose_changes_can_be_is_read(tmp_path: Path, mode: str) -> None:
    assert list(load(write(tmp_path, GOOD + mode)).architecture.modes) == ["night"]


@pytest.mark.parametrize(
    ("mode", "right", "wrong", "field", "problem"),
    [
        (SET, "max_velocity: 0.1", "max_velocty: 0.1", "1.parameters.max_velocty", "did you mean 'max_velocity'?"),
        (SET, "max_velocity: 0.1", "max_velocity: 0.9", "1.parameters.max_velocity", "0.9: must be at most 0.26 m/s"),
        (SET, "max_velocity: 0.1", "max_velocity: fast", "1.parameters.max_velocity", "'fast': must be a number"),
        (SET, "planner: straight", "planner: star", "1.parameters.planner", "must be one of: grid, straight"),
        (CONNECT, N, "component: recorder", "0.component", "is unmanaged"),
        (
            CONNECT,
            "port: odometry",
            "port: odometri",
            "0.port",
            "there is no port 'odometri'; did you mean 'odometry'?",
        ),
        (CONNECT, "topic: truth", "topic: trth", "0.topic", "not in the topic table; did you mean 'truth'?"),
        (CONNECT, "topic: truth", "topic: scan", "0.topic", "takes regraft/Odometry, but topic 'scan' carries"),
        (SWAP, "parts:Joystick", "parts:Joystik", "0.class", "has no class 'Joystik'; did you mean 'Joystick'?"),
        (SWAP, "tests.stack.parts:", "nowhere.parts:", "0.class", "cannot import"),
        (SWAP, "layout: ''", "layot: ''", "0.parameters.layot", "did you mean 'layout'?"),
        (
            SWAP,
            "layout: ''}",
            "layout: ''}, connect: {velocity: scan}",
            "0.connect.velocity",
            "carries regraft/LaserScan",
        ),
        (ADD, "true}", "true}, connect: {odometri: odometry}", "0.spec.connect.odometri", "did you mean 'odometry'?"),
        (
            AGAIN,
            "odometry:",
            "odometri:",
            "0.connect.odometri",
            "there is no port 'odometri'; did you mean 'odometry'?",
        ),
        (ADD, "careful: true", "careful: 1", "0.spec.parameters.careful", "1: must be a boolean"),
        (ADD, "parts:Navigator'", "parts:Navigato'", "0.spec.class", "did you mean 'Navigator'?"),
        (
            f"hosts: [edge]\n{ADD}",
            "careful: true}",
            "careful: true}, host: egde",
            "0.spec.host",
            "there is no host 'egde'; did you mean 'edge'?",
        ),
        (MOVE, "host: edge", "host: egde", "0.host", "there is no host 'egde'; did you mean 'edge'?"),
        (REMOVE, "[truth]", "[truth, trth]", "0.topics.1", "there is no topic 'trth'; did you mean 'truth'?"),
    ],
)
def test_a_change_that_can_never_be_is_told_in_its_line(
    tmp_path: Path, mode: str, right: str, wrong: str, field: str, problem: str
) -> None:
    assert right in mode
    text = GOOD + mode.replace(right, wrong)
    found = problems(tmp_path, text)
    own = [each for each in found if each.field == f"modes.night.{field}"]
    assert [each.line for each in own] == [line_of(text, wrong)], "\n".join(map(str, found))
    assert problem in own[0].problem
    assert len(found) == 1


def test_a_value_that_is_only_read_cannot_be_another_in_a_mode(tmp_path: Path) -> None:
    mode = "modes:\n  night:\n    - {change: set_parameters, component: world, parameters: {file: world.xml}}\n"
    load(write(tmp_path, GOOD + mode))
    (found,) = problems(tmp_path, GOOD + mode.replace("file: world", "file: moon"))
    assert found.field == "modes.night.0.parameters.file"
    assert found.problem.startswith("is read-only, set when the component starts")


def test_a_class_that_a_mode_swaps_in_may_take_what_the_stacks_class_does_not(tmp_path: Path) -> None:
    more = f"    - {{change: set_parameters, {N}, parameters: {{layout: ''}}}}\n"
    load(write(tmp_path, GOOD + SWAP + "  later:\n" + more))
    (found,) = problems(tmp_path, GOOD + SWAP + "  later:\n" + more.replace("layout", "layot"))
    assert found.field == "modes.later.0.parameters.layot"


DRIVE = "class: 'tests.stack.parts:Drive', parameters: {top_speed: 5.0, speed: 3.0, teeth: [8], gear_8: 2.0}"
ADDED = f"modes:\n  night:\n    - {{change: add, component: drive, spec: {{{DRIVE}}}}}\n"
SWAPPED = f"modes:\n  night:\n    - {{change: swap, {N}, {DRIVE}}}\n"
SAME = "components:\n  drive: {class: 'tests.stack.parts:Drive', connect: {velocity: other}}\n"
SAME_SWAPPED = f"modes:\n  night:\n    - {{change: swap, component: drive, {DRIVE.partition(', ')[2]}}}\n"
OWN = GOOD.replace("components:\n", SAME).replace("topics:\n", "topics:\n  other: regraft/Twist\n")


@pytest.mark.parametrize(
    ("stack", "mode", "above"),
    [(GOOD, ADDED, "spec."), (GOOD, SWAPPED, ""), (OWN, SAME_SWAPPED, "")],
)
def test_a_class_is_judged_by_what_its_mode_gives_it(tmp_path: Path, stack: str, mode: str, above: str) -> None:
    load(write(tmp_path, stack + mode))
    for right, wrong, name, problem in (
        ("speed: 3.0", "speed: 6.0", "speed", "6.0: must be at most 5.0"),
        ("gear_8: ", "gear_9: ", "gear_9", "did you mean 'gear_8'?"),
        ("teeth: [8], gear_8: 2.0", "teeth: [0]", "teeth.0", "0: must be at least 1"),
    ):
        text = stack + mode.replace(right, wrong)
        (found,) = problems(tmp_path, text)
        assert (found.field, found.line) == (f"modes.night.0.{above}parameters.{name}", line_of(text, wrong))
        assert problem in found.problem


def test_a_swap_on_another_host_that_names_no_class_is_judged_by_the_stacks_class(tmp_path: Path) -> None:
    stack = OWN.replace("drive: {class", "drive: {host: edge, class") + "hosts: [edge]\n"
    mode = "modes:\n  night:\n    - {change: swap, component: drive, parameters: {top_speed: 5.0, speed: 0.9}}\n"
    load(write(tmp_path, stack + mode))
    (found,) = problems(tmp_path, stack + mode.replace("speed: 0.9", "sped: 0.9"))
    assert found.field == "modes.night.0.parameters.sped"


def test_the_module_of_a_device_that_a_mode_names_is_tried_first(tmp_path: Path) -> None:
    (tmp_path / "leaving_device.py").write_text("import os\nos._exit(3)\n")
    robots = "[{name: a, model: a.xml, devices: [{name: lidar, class: 'leaving_device:Lidar'}]}]"
    spec = f"{{class: 'tests.stack.parts:Fleet', parameters: {{robots: {robots}}}}}"
    (found,) = problems(tmp_path, f"{GOOD}modes:\n  night:\n    - {{change: add, component: fleet, spec: {spec}}}\n")
    assert found.field == "modes.night.0.spec.parameters.robots.0.devices.0.class"
    assert "leaving_device" in found.problem


def test_a_mistake_in_the_mode_of_a_robots_file_is_told_there(tmp_path: Path) -> None:
    robot = ROBOT.replace("max_velocity: 0.1}", "max_velocty: 0.1}")
    found = problems_of(rovers(tmp_path, robot=robot))
    assert {(Path(each.file).name, each.line) for each in found} == {("robot.yaml", line_of(robot, "max_velocty"))}
    assert {each.field for each in found} == {
        f"modes.{name}/slow.0.parameters.max_velocty" for name in ("left", "right")
    }


def test_a_mistake_in_the_mode_of_an_included_file_is_told_there(tmp_path: Path) -> None:
    mode = "modes:\n  night:\n    - {change: transition, component: world, transition: activate}\n"
    mode += "    - {change: set_parameters, component: left.navigator, parameters: {max_velocity: 7}}\n"
    (found,) = problems_of(rovers(tmp_path, f"include: [base.yaml]\n{mode}", base=TWO))
    assert (Path(found.file).name, found.line) == (
        "stack.yaml",
        line_of(f"include: [base.yaml]\n{mode}", "max_velocity"),
    )
    (found,) = problems_of(rovers(tmp_path, "include: [base.yaml]\n", base=TWO + mode))
    assert (Path(found.file).name, found.line) == ("base.yaml", line_of(TWO + mode, "max_velocity: 7"))


def test_a_mistake_in_the_mode_of_a_ros_file_is_told_there(tmp_path: Path) -> None:
    file = """\
rescuer/navigator:
  ros__parameters:
    type: node
    modes:
      __DEFAULT__: {ros__parameters: {max_velocity: 0.2, planner: grid}}
      SLOW:
        ros__parameters:
          planner: straight
          max_velocity: 0.9
"""
    (tmp_path / "modes.yaml").write_text(file)
    (found,) = problems(tmp_path, f"{GOOD}modes: modes.yaml\n")
    assert (Path(found.file).name, found.line) == ("modes.yaml", line_of(file, "max_velocity: 0.9"))
    assert found.problem == "0.9: must be at most 0.26 m/s"
    unknown = file.replace("planner", "planer")
    (tmp_path / "modes.yaml").write_text(unknown)
    assert {each.line for each in problems(tmp_path, f"{GOOD}modes: modes.yaml\n")} == {5, 8, 9}


@pytest.mark.parametrize(
    ("file", "field"),
    [
        (
            "recorder: {ros__parameters: {type: node, modes: {__DEFAULT__: {ros__parameters: {depth: 3}}}}}\n",
            "recorder",
        ),
        (
            "drive: {ros__parameters: {type: system, modes: {__DEFAULT__: {recorder: active}}}}\n",
            "drive.modes.__DEFAULT__.recorder",
        ),
    ],
)
def test_a_ros_file_names_no_component_that_does_not_speak_the_lifecycle(tmp_path: Path, file: str, field: str) -> None:
    (tmp_path / "modes.yaml").write_text(file)
    (found,) = problems(tmp_path, f"{GOOD}modes: modes.yaml\n")
    assert (Path(found.file).name, found.line, found.field) == ("modes.yaml", 1, field)
    assert found.problem == "recorder is unmanaged: it does not speak the lifecycle"


def test_a_mode_that_is_wrong_is_told_alone(tmp_path: Path) -> None:
    wrong = MODES.replace("transition: activate", "transition: activte", 1)
    assert wrong != MODES
    more = "  night:\n    - {change: mode, mode: normal}\n"
    (found,) = problems(tmp_path, STACK + wrong + more + RULES)
    assert found.field.startswith("modes.")
    (found,) = problems(tmp_path, f"{STACK}modes: [1]\n{RULES}")
    assert found.field == "modes"
    (found,) = problems(tmp_path, f"{STACK}modes: none.yaml\n{RULES}")
    assert "no such file" in found.problem


def test_what_a_mode_would_have_be_two_things_is_told_at_the_second(tmp_path: Path) -> None:
    twice = """\
modes:
  slow:
    - {change: set_parameters, component: rescuer.navigator, parameters: {max_velocity: 0.1}}
    - {change: set_parameters, component: rescuer.navigator, parameters: {max_velocity: 0.2}}
"""
    (found,) = problems(tmp_path, GOOD + twice)
    assert (found.field, found.line) == ("modes.slow.1.parameters.max_velocity", line_of(GOOD + twice, "0.2}"))
    assert found.problem == "is to be 0.2 here, but 0.1 earlier among the same changes"
