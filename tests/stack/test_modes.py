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
    ("mode", "problem"),
    [
        ("[]", "must be a list of changes"),
        ("dark", "must be a list of changes"),
        ("[{change: sleep}]", "changes.0"),
        ("[{change: set_parameters, component: world}]", "parameters"),
        ("[{change: mode, mode: night}]", "enters itself: night > night"),
        ("[{change: mode, mode: nihgt}]", "there is no mode 'nihgt'; did you mean 'night'?"),
        (f"[{SLOW.replace('rescuer.navigator', 'wrld')}]", "there is no component 'wrld'; did you mean 'world'?"),
    ],
)
def test_a_mode_that_cannot_be_read_is_told_with_its_line(tmp_path: Path, mode: str, problem: str) -> None:
    text = _with(mode)
    (found,) = problems(tmp_path, text)
    assert (found.field, found.line) == ("modes.night", line_of(text, "night"))
    assert problem in found.problem
