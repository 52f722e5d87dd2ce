"""The skills of a robot among several are compared with its own components and modes."""

from __future__ import annotations

from pathlib import Path

from regraft.stack import StackError, check_with_classes, load
from tests.cli.live import regraft
from tests.metacontrol.robots.stacks import SKILLS, write


def problems(folder: Path, skills: str) -> list[str]:
    """Return what is wrong with the stack, without the folder's name."""
    try:
        check_with_classes(load(write(folder, skills)))
    except StackError as error:
        return [str(each).replace(f"{folder}/", "") for each in error.problems]
    return []


def test_each_robot_may_have_the_skills_and_modes_of_its_folder(tmp_path: Path) -> None:
    assert problems(tmp_path, SKILLS) == []


def test_components_and_values_are_those_of_the_robot(tmp_path: Path) -> None:
    wrong = SKILLS.replace("Component laser", "Component lasr").replace("0.4 }", "4.0 }")
    found = problems(tmp_path, wrong)
    assert any(
        "carrier.skills:7:11: error: there is no component 'north.lasr'; did you mean 'north.laser'?" in each
        for each in found
    )
    assert any("north.controller.FollowPath.max_vel_x: 4.0: must be at most 1.0 m/s" in each for each in found)


def test_a_realization_needs_a_mode_of_the_robot(tmp_path: Path) -> None:
    found = problems(tmp_path, SKILLS.replace("Realization degraded", "Realization careful"))
    assert any("careful: there is no mode 'north/to_navigate.careful'" in each for each in found)


def test_the_check_of_skills_takes_a_robot_of_the_stack(tmp_path: Path) -> None:
    stack = write(tmp_path)
    skills, home = str(tmp_path / "carrier" / "carrier.skills"), tmp_path / "home"
    home.mkdir()
    right = regraft(home, "skills", "check", skills, "--stack", str(stack), "--robot", "south")
    assert right.returncode == 0, right.stderr
    of_system = regraft(home, "skills", "check", skills, "--stack", str(stack))
    assert of_system.returncode == 2
    assert "there is no component 'laser'" in of_system.stderr
    unknown = regraft(home, "skills", "check", skills, "--stack", str(stack), "--robot", "suoth")
    assert (unknown.returncode, unknown.stderr.strip()) == (
        2,
        "regraft: --robot suoth: there is no robot 'suoth'; did you mean 'south'?",
    )
    alone = regraft(home, "skills", "check", skills, "--robot", "south")
    assert alone.returncode == 2
    assert "needs --stack" in alone.stderr
