"""With a stack, components and their parameters are compared with what their classes declare."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code
from regraft.adaptation_manager.planners.metacontrol.skills.reading import checked_skills
from regraft.stack import load
from tests.metacontrol.skills.texts import at, place_of, realization, skill
from tests.stack.reading.files import write
from tests.support.paths import ROOT

FROG = ROOT / "regraft" / "stacks" / "frog" / "stack.yaml"
SLOW = "Component navigator { Configuration active.SLOW { max_velocity: 0.1 } }"


def found(components: str, folder: Path) -> list[tuple[Code, tuple[int, int], str]]:
    """Return what is wrong in FROG's stack with a skill whose realization has these components."""
    file = folder / "f.skills"
    file.write_text(skill(realization(components=components, rest="Quality [speed: 1]")))
    architecture = load(FROG).architecture
    return [(each.code, at(each), each.message) for each in checked_skills(file, architecture).diagnostics]


def test_what_the_stack_has_is_right(tmp_path: Path) -> None:
    assert found(SLOW, tmp_path) == []


@pytest.mark.parametrize(
    ("right", "wrong", "code", "message"),
    [
        (
            "Component navigator",
            "Component navigatr",
            Code.UNKNOWN_COMPONENT,
            "there is no component 'navigatr'; did you mean 'navigator'?",
        ),
        (
            "max_velocity",
            "max_velocty",
            Code.UNKNOWN_PARAMETER,
            "navigator.max_velocty: there is no such parameter; did you mean 'max_velocity'?",
        ),
        ("0.1", "9.5", Code.UNFIT_VALUE, "navigator.max_velocity: 9.5: must be at most 0.26 m/s"),
        ("0.1", '"fast"', Code.UNFIT_VALUE, "navigator.max_velocity: 'fast': must be a number"),
        ("0.1", "true", Code.UNFIT_VALUE, "navigator.max_velocity: True: must be a number"),
    ],
)
def test_what_the_stack_has_not_is_refused_at_its_place(
    right: str, wrong: str, code: Code, message: str, tmp_path: Path
) -> None:
    text = SLOW.replace(right, wrong)
    (one,) = found(text, tmp_path)
    piece = wrong.removeprefix("Component ") if "Component" in wrong else "max_veloc"
    assert one == (code, place_of((tmp_path / "f.skills").read_text(), piece), message)


def test_a_component_that_does_not_speak_the_lifecycle_is_refused(tmp_path: Path) -> None:
    stack = write(tmp_path, 'system: one\ncomponents:\n  logger: {command: ["sleep", "9"], managed: false}\n')
    file = tmp_path / "f.skills"
    file.write_text(skill(realization(components="Component logger active", rest="Quality [speed: 1]")))
    (one,) = checked_skills(file, load(stack).architecture).diagnostics
    assert (one.code, "'logger' is unmanaged" in one.message) == (Code.UNMANAGED_COMPONENT, True)


def test_each_problem_is_reported_once(tmp_path: Path) -> None:
    several = ", ".join((SLOW.replace("0.1", "9.5"), "Component nix active"))
    text = realization("x", several) + realization("y", several)
    file = tmp_path / "f.skills"
    file.write_text(skill(text))
    architecture = load(FROG).architecture
    codes = [each.code for each in checked_skills(file, architecture).diagnostics]
    assert codes.count(Code.UNKNOWN_COMPONENT) == codes.count(Code.UNFIT_VALUE) == 1
