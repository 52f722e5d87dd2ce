"""A number that is too large is refused as such, wherever a stack file, an override or a constraint has one."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.values import value_of
from regraft.stack import StackError, apply_overrides
from tests.stack.reading.files import changed, good, problems

LARGE = ["9" * 400, "-" + "9" * 400, "9" * 5000, "9" * 400 + ".5", "1e400", "1e9999999999", "0x" + "f" * 400]
PLACES = {
    "duration": ("duration: 120", "duration: {}"),
    "seed": ("seed: 1", "seed: {}"),
    "topics.odometry.rate": ("rate: 20}", "rate: {}}}"),
    "components.world.parameters.tick_rate": ("tick_rate: 10", "tick_rate: {}"),
    "components.rescuer.navigator.restart.limit": ("limit: 3", "limit: {}"),
    "constraints.1.at_most": ("at_most: 0.26", "at_most: {}"),
}


@pytest.mark.parametrize("number", LARGE, ids=lambda number: f"{number[:6]}-{len(number)}")
@pytest.mark.parametrize("place", PLACES)
def test_a_number_that_is_too_large_is_no_text(tmp_path: Path, place: str, number: str) -> None:
    old, new = PLACES[place]
    (problem,) = problems(tmp_path, changed((old, new.format(number))))
    assert problem.field == place
    assert "is too large for a number" in problem.problem
    assert len(problem.problem) < 200


@pytest.mark.parametrize("number", ["9" * 31, "0x" + "f" * 40, "1e30"])
@pytest.mark.parametrize("place", ["duration", "seed", "components.rescuer.navigator.restart.limit"])
def test_a_number_beyond_a_fields_bounds_is_told_with_them(tmp_path: Path, place: str, number: str) -> None:
    old, new = PLACES[place]
    (problem,) = problems(tmp_path, changed((old, new.format(number))))
    assert problem.field == place
    assert "must be from" in problem.problem or "must be at most" in problem.problem


def test_a_number_in_an_expression_has_bounds_too(tmp_path: Path) -> None:
    rule = "parameter: rescuer.navigator.max_velocity\n    at_most: 0.26"
    for number in ("9" * 400, "1e400"):
        text = changed((rule, f"require: rescuer.navigator.max_velocity < {number}"))
        (problem,) = problems(tmp_path, text)
        assert problem.problem.endswith("holds a number that is too large: it goes to about 1.8e308")


def test_digits_in_quotes_are_a_text(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path, changed(("tick_rate: 10", f"tick_rate: '{'9' * 400}'")))
    assert problem.problem.endswith("must be a number")


@pytest.mark.parametrize("number", LARGE, ids=lambda number: f"{number[:6]}-{len(number)}")
def test_a_typed_number_has_the_same_bounds(tmp_path: Path, number: str) -> None:
    with pytest.raises(StackError, match=r"--set world\.tick_rate=.*is too large for a number"):
        apply_overrides(good(tmp_path), [f"world.tick_rate={number}"])
    for typed in (number, f"[{number}]"):
        with pytest.raises(BadInput, match="is too large for a number"):
            value_of(typed, "value")
