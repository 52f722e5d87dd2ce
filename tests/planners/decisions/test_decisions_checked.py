"""A decision that can mean nothing is refused before anything runs: by file, line and field, and once."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.decisions.reading import read_decision
from regraft.stack import StackError
from regraft.stack.yaml.problems import Problem
from tests.planners.decisions.test_decision_files import RESCUER, written

LIMIT = '{limit: power, at_most: "4.0 if charge > 0.5 else 3.0"}'
REQUIRE = '"wheels.speed < 0.3 or dark < 0.5"'


def _problems(folder: Path, *changes: tuple[str, str]) -> tuple[Problem, ...]:
    text = RESCUER
    for right, wrong in changes:
        assert right in text, right
        text = text.replace(right, wrong, 1)
    with pytest.raises(StackError) as refused:
        read_decision(written(folder, text))
    return refused.value.problems


@pytest.mark.parametrize(
    ("right", "wrong", "line", "field", "problem"),
    [
        ("[0, 2]", "[0, 5]", 7, "choices.senses.choose", "is [0, 5], must be a number, or [least, most], of the 3 alt"),
        ("[0, 2]", "4", 7, "choices.senses.choose", "is 4, must be"),
        ("[0.1, 0.26]", "[]", 18, "choices.speed.values", "must be a list of at least one"),
        ("value: 0.1}]", "value: 0.1}, {component: wheels, parameter: max_velocity, value: 0.2}]", 17,
         "choices.radio.alternatives.talking.set.2", "sets a thing that is set before"),
        ("{at_least: 1}", "{at_least: 3, at_most: 2}", 29, "objective.bounds.sight.at_least", "3: must be at most"),
        ("{at_least: 1}", "{}", 29, "objective.bounds.sight", "has no bound"),
        ("{at_least: 1}", "{at_least: \"'a'\"}", 29, "objective.bounds.sight.at_least", "both must be of one kind"),
        ("stale_after: 2", "stale_after: 0", 2, "context.dark.stale_after", "must be greater than 0"),
        ("{senses: camera}", "{senses: []}", 33, "faults.lens_dusty.excludes.senses", "is an empty list"),
        ("excludes: {senses: camera}", "excludes: {speed: [0.1, 0.26]}", 33, "faults.lens_dusty.excludes.speed",
         "leaves nothing to choose"),
        ("    prescribes: {radio", "    excludes: {speed: 0.1}\n    prescribes: {radio", 37,
         "faults.overheated.prescribes.speed", "that the same fault excludes"),
        ("{radio: silent, speed: 0.1}", "{}", 34, "faults.overheated", "has no consequence"),
        (REQUIRE, "'1 < 2'", 22, "constraints.2.require", "speaks of nothing that changes"),
        ("dark > 0.95", "true", 32, "faults.lens_dusty.when", "speaks of nothing that changes"),
        ("dark > 0.95", "speed > 0.2", 32, "faults.lens_dusty.when", "nothing is called 'speed' here"),
        ("dark > 0.95", "total.sight > 2", 32, "faults.lens_dusty.when", "nothing is called 'total.sight' here"),
        ("4.0 if charge > 0.5 else 3.0", "sight", 21, "constraints.1.at_most", "nothing is called 'sight' here"),
        (LIMIT, "{forbid: {speed: [0.1, 0.26]}}", 21, "constraints.1", "can never be kept"),
        ("total.sight", "total.sigth", 24, "qualities.sight", "no figure 'sigth'; did you mean 'sight'?"),
        ("total.reach", "radio.raech", 25, "qualities.reach.estimated", "radio has no figure 'raech'; did you mean"),
    ],
)  # fmt: skip
def test_what_can_never_be_is_named(
    tmp_path: Path, right: str, wrong: str, line: int, field: str, problem: str
) -> None:
    (found,) = _problems(tmp_path, (right, wrong))
    assert (found.field, found.line) == (field, line)
    assert problem in found.problem


@pytest.mark.parametrize(
    ("right", "wrong", "line", "field", "problem"),
    [
        (REQUIRE, "5", 22, "constraints.2.require", "5 is a number, must be true or false, such as: NAME > 5"),
        (REQUIRE, "wheels.speed", 22, "constraints.2.require", "such as: wheels.speed > 0"),
        (REQUIRE, "radio", 22, "constraints.2.require", "radio is a text, must be true or false, such as: radio == 'a"),
        (REQUIRE, "radio == 'slient'", 22, "constraints.2.require", "which it never is; did you mean 'silent'?"),
        (REQUIRE, "senses == 'camera'", 22, "constraints.2.require", "senses, a list, is compared with"),
        (REQUIRE, "speed == 'fast'", 22, "constraints.2.require", "speed, a number, is compared with 'fast', a text"),
        (REQUIRE, "radio < 3", 22, "constraints.2.require", "radio, a text, is compared with 3, a number"),
        (REQUIRE, "sight", 22, "constraints.2.require", "sight is a number"),
        ("dark > 0.95", "1", 32, "faults.lens_dusty.when", "1 is a number, must be true or false"),
        ("dark > 0.95", "dark > 0.95 and 3", 32, "faults.lens_dusty.when", "3 is a number"),
        ("seeing * sight", "seeing * radio", 27, "objective.utility", "radio is a text, must be a number"),
        ("seeing * sight", "abs(seeing, sight)", 27, "objective.utility", "abs takes 1, not 2 values"),
        ("2.0 if dark > 0.5 else 1.0", "2.0 if 'dark' else 1.0", 28, "objective.weights.seeing", "'dark' is a text"),
        ("4.0 if charge > 0.5 else 3.0", "'four'", 21, "constraints.1.at_most", "'four' is a text, must be a number"),
        ("total.reach", "\"'far'\"", 25, "qualities.reach.estimated", "'far' is a text, must be a number"),
    ],
)  # fmt: skip
def test_an_expression_of_the_wrong_kind_is_named(
    tmp_path: Path, right: str, wrong: str, line: int, field: str, problem: str
) -> None:
    (found,) = _problems(tmp_path, (right, wrong))
    assert (found.field, found.line) == (field, line)
    assert problem in found.problem


@pytest.mark.parametrize(
    ("assumed", "weight", "name"),
    [
        ("wheels.speed * 2", "2.0", "wheels.speed"),
        ("seeing * 2", "1.0 + wheels.speed", "wheels.speed"),
        ("dark if camera.clearness > 1 else 0", "2.0", "camera.clearness"),
    ],
)
def test_an_assumption_speaks_of_no_estimate(tmp_path: Path, assumed: str, weight: str, name: str) -> None:
    given = f'seeing: "{weight}"}}\n  assume: {{far: "{assumed}"'
    (found,) = _problems(tmp_path, ('seeing: "2.0 if dark > 0.5 else 1.0"', given))
    assert (found.field, found.line) == ("objective.assume.far", 29)
    assert found.problem == f"{name} is an estimate, and estimates are worked out from what is assumed"


@pytest.mark.parametrize(
    "assumed",
    ["seeing * dark", "total.sight + radio.reach", "speed if radio == 'silent' else 0.0", "qualities.Safe.degree",
     "near * 2"],
)  # fmt: skip
def test_an_assumption_speaks_of_what_is_known_and_chosen(tmp_path: Path, assumed: str) -> None:
    given = f'seeing: "2.0"}}\n  assume: {{near: "0.5 * dark", far: "{assumed}"'
    read_decision(written(tmp_path, RESCUER.replace('seeing: "2.0 if dark > 0.5 else 1.0"', given)))


@pytest.mark.parametrize(
    "condition",
    ["hot", "not hot", "known(hot, False)", "dark > 0.2 or hot", "radio == 'silent' and speed < 0.2", "hot == 1",
     "True if hot else dark < 0.1", "min(dark, hot) > 0", "'a' + radio == 'asilent'", "qualities.Safe.satisfied"],
)  # fmt: skip
def test_what_may_be_a_condition_is_taken_as_one(tmp_path: Path, condition: str) -> None:
    text = RESCUER.replace("{topic: power, field: consumers.motion}", "{fault: wheels}").replace("hot > 20.0", "hot")
    read_decision(written(tmp_path, text.replace(REQUIRE, f'"{condition}"')))


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ([("values: [0.1, 0.26]", "values: [0.1, 0.1]")], "choices.speed.values.1"),
        ([("values: [0.1, 0.26]", "valus: [0.1, 0.26]")], "choices.speed"),
        ([("sight: 3, power: 2", "sight: 3, power: high")], "choices.senses.alternatives.camera.figures.power"),
        ([("choose: [0, 2]", "choose: few"), ("excludes: {senses: camera}", "excludes: {senses: [x]}")],
         "choices.senses.choose"),
        ([("set: {component: drive, state: inactive}", "otherwise: {component: drive, state: idle}")],
         "choices.radio.alternatives.silent.otherwise"),
        ([("camera:     {", "camera: {otherwise: {component: drive, state: active}, "),
          ("infrared:   {", "infrared: {otherwise: {component: drive, state: inactive}, ")],
         "choices.senses.alternatives.infrared.otherwise"),
        ([("seeing: \"2.0 if dark", "seeing: \"2.0 fi dark")], "objective.weights.seeing"),
        ([("seeing: \"2.0 if dark > 0.5 else 1.0\"", "seeing: \"2.0\"}\n  assume: {far: radio.raech")],
         "objective.assume.far"),
        ([("field: charge}", "feild: charge}")], "context.charge"),
    ],
)  # fmt: skip
def test_one_mistake_is_named_where_it_is_and_nowhere_else(
    tmp_path: Path, changes: list[tuple[str, str]], field: str
) -> None:
    found = _problems(tmp_path, *changes)
    assert {each.field.startswith(field) for each in found} == {True}, "\n".join(map(str, found))
