"""Modes files of ROS 2's system_modes are read as they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import AdaptationRequest, ChangeState, SetParameters
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.bus_schema.model.modes.modes import as_needed, is_in_force
from regraft.stack import StackError, load
from regraft.stack.sections.system_modes import read_system_modes
from tests.adaptation.system import small_architecture
from tests.stack.reading.files import GOOD, write

FILE = """\
---
actuation:
  ros__parameters:
    type: system
    parts:
      manipulator
      drive_base
    modes:
      __DEFAULT__:
        manipulator: inactive
        drive_base: active
      MODERATE:
        manipulator: active.WEAK
        drive_base: active.SLOW
      FAST:
        drive_base: active
    rules:
      degrade_from_MODERATE:
        if_target: active.MODERATE
        if_part: [manipulator, inactive]
        new_target: active.__DEFAULT__
manipulator:
  ros__parameters:
    type: node
    modes:
      __DEFAULT__:
        ros__parameters:
          max_torque: 0.1
          arm: {speed: 1}
      WEAK:
        ros__parameters:
          max_torque: 0.05
/robot/drive_base:
  ros__parameters:
    type: node
    modes:
      __DEFAULT__: {ros__parameters: {max_speed: 0.5}}
      SLOW: {ros__parameters: {max_speed: 0.2}}
mission:
  ros__parameters:
    type: system
    modes:
      __DEFAULT__: {actuation: active.MODERATE}
      REST: {actuation: inactive}
"""
COMPONENTS = ("manipulator", "robot.drive_base")


def _file(folder: Path, text: str) -> Path:
    file = folder / "modes.yaml"
    file.write_text(text)
    return file


def _good() -> str:
    return FILE.replace("drive_base: active", "/robot/drive_base: active")


def _changes(folder: Path, mode: str) -> list[dict[str, object]]:
    changes = read_system_modes(_file(folder, _good()), COMPONENTS)[mode]
    assert isinstance(changes, list)
    return changes


def test_every_mode_of_every_part_is_one_of_ours(tmp_path: Path) -> None:
    modes = read_system_modes(_file(tmp_path, _good()), COMPONENTS)
    assert list(modes) == [
        "actuation.__DEFAULT__",
        "actuation.MODERATE",
        "actuation.FAST",
        "manipulator.__DEFAULT__",
        "manipulator.WEAK",
        "/robot/drive_base.__DEFAULT__",
        "/robot/drive_base.SLOW",
        "mission.__DEFAULT__",
        "mission.REST",
    ]


def test_what_a_mode_leaves_out_it_has_from_the_default(tmp_path: Path) -> None:
    weak, activate = _changes(tmp_path, "manipulator.WEAK")
    assert weak["parameters"] == {"max_torque": 0.05, "arm.speed": 1}
    assert (activate["component"], activate["transition"]) == ("manipulator", "activate")
    first, *_ = _changes(tmp_path, "actuation.FAST")
    assert (first["component"], first["transition"]) == ("manipulator", "deactivate")


def test_systems_of_systems_are_followed_down_to_the_components(tmp_path: Path) -> None:
    assert _changes(tmp_path, "mission.__DEFAULT__") == _changes(tmp_path, "actuation.MODERATE")
    rest = _changes(tmp_path, "mission.REST")
    assert [(change["component"], change["transition"]) for change in rest] == [
        ("manipulator", "deactivate"),
        ("robot.drive_base", "deactivate"),
    ]


@pytest.mark.parametrize(
    ("old", "new", "piece", "problem"),
    [
        (
            "ros__parameters:\n    type: system\n    parts",
            "ros_parameters:\n    type: system\n    parts",
            "actuation:",
            "two underscores",
        ),
        (
            "    modes:\n      __DEFAULT__:\n        manipulator",
            "    modes:\n      OTHER:\n        manipulator",
            "modes:",
            "must begin with __DEFAULT__",
        ),
        ("active.WEAK", "active.WEEK", "active.WEEK", "manipulator has no mode 'WEEK'; did you mean 'WEAK'?"),
        ("active.WEAK", "on", "manipulator: on", "must be one of: active, inactive, unconfigured"),
        ("manipulator: active.WEAK", "manipulater: active", "manipulater", "there is no part 'manipulater'"),
        ("max_torque: 0.05", "torque: 0.05", "torque: 0.05", "__DEFAULT__ does not name it"),
        ("\nmanipulator:", "\nmanipulato:", "\nmanipulato:", "there is no component 'manipulato'"),
        ("{actuation: inactive}", "{actuation: inactive, mission: active}", "mission:", "is a part of itself"),
        ("  SLOW:", "\tSLOW:", "SLOW:", "a tab"),
        ("  REST:", "  REST/:", "{actuation: inactive}", "a mode's name may not end with '/'"),
        (
            "      __DEFAULT__: {actuation: active.MODERATE}\n      REST: {actuation: inactive}",
            "      __DEFAULT__: {}",
            "mission:",
            "names no part: must name at least one",
        ),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path: Path, old: str, new: str, piece: str, problem: str) -> None:
    text = _good()
    assert old in text
    text = text.replace(old, new, 1)
    with pytest.raises(StackError) as found:
        read_system_modes(_file(tmp_path, text), COMPONENTS)
    start = text.index(piece) + (piece[0] == "\n")
    line = text.count("\n", 0, start) + 1
    assert any(problem in one.problem and one.line == line for one in found.value.problems), str(found.value)


def test_systems_of_systems_that_stand_for_too_many_changes_are_refused(tmp_path: Path) -> None:
    def system(name: str, parts: str) -> str:
        return f"{name}: {{ros__parameters: {{type: system, modes: {{__DEFAULT__: {{{parts}}}}}}}}}\n"

    text = system("a 0", "manipulator: active") + system("b 0", "manipulator: active")
    for n in range(1, 40):
        text += "".join(system(f"{name} {n}", f"a {n - 1}: active, b {n - 1}: inactive") for name in "ab")
    with pytest.raises(StackError) as found:
        read_system_modes(_file(tmp_path, text), COMPONENTS)
    problem = next(each for each in found.value.problems if each.field.startswith("a 12."))
    assert problem.line == 25
    assert problem.problem == "has 16382 changes with those of the modes that it enters; it may have 10000"


def test_a_stack_may_name_such_a_file(tmp_path: Path) -> None:
    node = "{ros__parameters: {type: node, modes: {__DEFAULT__: {ros__parameters: {max_velocity: 0.2}}}}}"
    _file(tmp_path, f"rescuer/navigator: {node}\n")
    architecture = load(write(tmp_path, f"{GOOD}modes: modes.yaml\n")).architecture
    assert list(architecture.modes) == ["rescuer/navigator.__DEFAULT__"]
    _file(tmp_path, f"wrong: {node}\n")
    with pytest.raises(StackError, match=r"modes.yaml:1: wrong: there is no component 'wrong'"):
        load(write(tmp_path, f"{GOOD}modes: modes.yaml\n"))
    with pytest.raises(StackError, match="no such file"):
        load(write(tmp_path, f"{GOOD}modes: none.yaml\n"))


def test_entering_a_mode_takes_the_transitions_that_are_needed_and_no_other() -> None:
    plain = [
        {"change": "transition", "component": name, "transition": to}
        for name, to in (("scanner", "activate"), ("listener", "activate"), ("talker", "cleanup"))
    ]
    quieter = {"change": "set_parameters", "component": "listener", "parameters": {"gain": 0.1}}
    mode = codec.from_plain({"changes": [*plain, quieter]}, AdaptationRequest).changes
    now = small_architecture()
    assert as_needed(mode, now) == (
        ChangeState("scanner", Transition.ACTIVATE),
        ChangeState("talker", Transition.DEACTIVATE),
        ChangeState("talker", Transition.CLEANUP),
        SetParameters("listener", {"gain": 0.1}),
    )
    earlier = [ChangeState("listener", Transition.DEACTIVATE)]
    assert ChangeState("listener", Transition.ACTIVATE) in as_needed(mode, now, earlier)


def test_a_mode_is_in_force_when_all_is_exactly_as_it_wants() -> None:
    now = small_architecture()
    mode = (ChangeState("scanner", Transition.DEACTIVATE), SetParameters("listener", {"gain": 0.5}))
    assert now.components["scanner"].state is State.INACTIVE
    assert is_in_force(mode, now)
    assert not is_in_force((*mode, SetParameters("second", {"gain": 0.6})), now)
