"""Modes of a stack file: changes with a name, refused with their line if they cannot be read."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.stack import load
from tests.stack.reading.files import GOOD, line_of, problems, write

SLOW = "{change: set_parameters, component: rescuer.navigator, parameters: {max_velocity: 0.1}}"
ADDED = "{change: add, component: second, spec: {class: 'tests.stack.parts:Navigator'}}"


def _with(mode: str) -> str:
    return f"{GOOD}modes:\n  night: {mode}\n"


def test_a_mode_is_read_as_its_changes(tmp_path: Path) -> None:
    text = _with(f"[{SLOW}, {ADDED}, {{change: transition, component: second, transition: deactivate}}]")
    modes = load(write(tmp_path, text)).architecture.modes
    assert list(modes) == ["night"]
    assert modes["night"][0] == {
        "change": "set_parameters",
        "component": "rescuer.navigator",
        "parameters": {"max_velocity": 0.1},
    }


@pytest.mark.parametrize(
    ("mode", "field", "problem"),
    [
        ("[]", "", "must be a list of changes"),
        ("dark", "", "must be a list of changes"),
        ("[{change: sleep}]", ".0.change", "is 'sleep', must be one of"),
        ("[{change: set_parameters, component: world}]", ".0.parameters", "missing"),
        ("[{change: mode, mode: night}]", ".0.mode", "enters itself: night > night"),
        ("[{change: mode, mode: nihgt}]", ".0.mode", "there is no mode 'nihgt'; did you mean 'night'?"),
        (
            f"[{SLOW.replace('rescuer.navigator', 'wrld')}]",
            ".0.component",
            "there is no component 'wrld'; did you mean 'world'?",
        ),
    ],
)
def test_a_mode_that_cannot_be_read_is_told_with_its_line(tmp_path: Path, mode: str, field: str, problem: str) -> None:
    text = _with(mode)
    (found,) = problems(tmp_path, text)
    assert (found.field, found.line) == (f"modes.night{field}", line_of(text, "night"))
    assert problem in found.problem


def test_each_change_of_a_mode_that_is_wrong_is_told_in_its_own_line(tmp_path: Path) -> None:
    text = f"{GOOD}modes:\n  night:\n    - {SLOW}\n    - change: transition\n      component: world\n"
    text += "      transition: activte\n    - {change: sleep}\n"
    first, second = problems(tmp_path, text)
    assert (first.field, first.line) == ("modes.night.1.transition", line_of(text, "activte"))
    assert (second.field, second.line) == ("modes.night.2.change", line_of(text, "sleep"))


def test_of_many_unknown_modes_near_ones_are_looked_up_for_the_first_alone(tmp_path: Path) -> None:
    text = f"{GOOD}modes:\n" + "".join(f"  mode_{n}: [{{change: mode, mode: made_{n}}}]\n" for n in range(30))
    found = problems(tmp_path, text)
    assert len(found) == 30
    assert "did you mean 'mode_0'?" in found[0].problem
    assert found[-1].problem == "there is no mode 'made_29'; there are 30 others"


def test_a_circle_of_modes_is_told_once_and_modes_that_lead_to_it_are_not_blamed(tmp_path: Path) -> None:
    modes = {"before": "dusk", "dusk": "night", "night": "dusk"}
    text = f"{GOOD}modes:\n" + "".join(f"  {a}: [{{change: mode, mode: {b}}}]\n" for a, b in modes.items())
    (found,) = problems(tmp_path, text)
    assert (found.field, found.line) == ("modes.dusk.0.mode", line_of(text, "dusk: "))
    assert found.problem == "enters itself: dusk > night > dusk"


def test_modes_that_stand_for_too_many_changes_are_refused(tmp_path: Path) -> None:
    text = f"{GOOD}modes:\n  mode_0: [{SLOW}]\n"
    for n in range(1, 40):
        text += f"  mode_{n}:\n" + f"    - {{change: mode, mode: mode_{n - 1}}}\n" * 2
    first = problems(tmp_path, text)[0]
    assert (first.field, first.line) == ("modes.mode_12", line_of(text, "mode_12:"))
    assert first.problem == "has 12286 changes with those of the modes that it enters; it may have 10000"


@pytest.mark.parametrize("is_circle", [True, False])
def test_modes_that_enter_each_other_in_a_long_row_are_refused(tmp_path: Path, is_circle: bool) -> None:
    start = "{change: mode, mode: mode_2999}" if is_circle else SLOW
    text = f"{GOOD}modes:\n  mode_0: [{start}]\n"
    text += "".join(f"  mode_{n}: [{{change: mode, mode: mode_{n - 1}}}]\n" for n in range(1, 3000))
    found = problems(tmp_path, text)
    assert any("deep; it may be 50" in each.problem for each in found)
    lines = {each.line for each in found}
    assert is_circle or line_of(text, "mode_49:") not in lines


def test_modes_in_many_circles_are_refused_in_time(tmp_path: Path) -> None:
    names = [f"mode_{n}" for n in (0, *range(20, 0, -1))]
    text = f"{GOOD}modes:\n"
    for name in names:
        n = int(name.partition("_")[2])
        entered = [f"mode_{each}" for each in (*range(n), n + 1) if each <= 20]
        text += f"  {name}: [{', '.join(f'{{change: mode, mode: {each}}}' for each in entered)}]\n"
    assert any("enters itself" in each.problem for each in problems(tmp_path, text))


def test_all_modes_together_are_bounded(tmp_path: Path) -> None:
    text = f"{GOOD}modes:\n  mode_0: [{SLOW}]\n"
    for n in range(1, 12):
        text += f"  mode_{n}:\n" + f"    - {{change: mode, mode: mode_{n - 1}}}\n" * 2
    text += "".join(f"  large_{n}: [{{change: mode, mode: mode_11}}]\n" for n in range(30))
    assert any("all modes may have 100000 changes" in each.problem for each in problems(tmp_path, text))
