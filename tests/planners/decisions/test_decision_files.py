"""Decision files: what they describe is read, and what is wrong with them is named by file, line and field."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from regraft.adaptation_manager.planners.choices.choosing import Choice
from regraft.adaptation_manager.planners.choices.estimates import ClassEstimates
from regraft.adaptation_manager.planners.choices.solvers.branch_and_bound import BranchAndBound
from regraft.adaptation_manager.planners.decisions.checking import not_learned, not_predicted
from regraft.adaptation_manager.planners.decisions.question import Question, question_of
from regraft.adaptation_manager.planners.decisions.reading import read_decision
from regraft.adaptation_manager.planners.decisions.showing import choice_lines
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import ChangeState, SetParameters
from regraft.bus_schema.model.lifecycle import Transition
from regraft.stack import StackError
from tests.planners.choices.test_choosing import wheeled

RESCUER = """\
context:
  dark:    {topic: light, field: darkness, stale_after: 2}
  charge:  {topic: battery, field: charge}
  hot:     {topic: power, field: consumers.motion}
choices:
  senses:
    choose: [0, 2]
    alternatives:
      camera:     {figures: {sight: 3, power: 2}}
      microphone: {figures: {sight: 0.5, power: 1}}
      infrared:   {figures: {sight: 2, power: 1}}
  radio:
    alternatives:
      silent: {figures: {reach: 0, power: 0}, set: {component: drive, state: inactive}}
      talking:
        figures: {reach: 3, power: 2}
        set: [{component: drive, state: active}, {component: wheels, parameter: max_velocity, value: 0.1}]
  speed: {component: wheels, parameter: max_velocity, values: [0.1, 0.26]}
constraints:
  - {if: {radio: talking}, then: {senses: [camera, infrared]}, because: it talks of what it sees}
  - {limit: power, at_most: "4.0 if charge > 0.5 else 3.0"}
  - {require: "wheels.speed < 0.3 or dark < 0.5"}
qualities:
  sight: total.sight
  reach: {estimated: total.reach}
objective:
  utility: seeing * sight + reach + wheels.speed
  weights: {seeing: "2.0 if dark > 0.5 else 1.0"}
  bounds: {sight: {at_least: 1}}
faults:
  lens_dusty:
    when: dark > 0.95
    excludes: {senses: camera}
  overheated:
    when: hot > 20.0
    prescribes: {radio: silent, speed: 0.1}
"""
DAY = {"dark": 0.1, "charge": 0.9, "hot": 5.0}


ODD = (
    "",
    "x",
    "~",
    "1e999",
    "-1",
    "true",
    "[]",
    "{}",
    "{a: [1, {b: 2}]}",
    "nan",
    ".nan",
    "'",
    "camera",
    "wheels.speed",
    "a+",
)


def written(folder: Path, text: str) -> Path:
    file = folder / "rescue.yaml"
    file.write_text(text)
    return file


def asked(folder: Path, context: dict[str, float], text: str = RESCUER) -> tuple[Question, Choice]:
    now = wheeled()
    question = question_of(read_decision(written(folder, text)), context, ClassEstimates(now))
    return question, question.choose(now, BranchAndBound())


def values(choice: Choice) -> tuple[object, ...]:
    assert choice.option is not None
    return choice.option.values


def test_a_decision_weighs_alternatives_by_the_context_within_its_limits(tmp_path: Path) -> None:
    _, day = asked(tmp_path, DAY)
    assert values(day) == (["camera"], "talking", 0.1)
    assert day.changes == (SetParameters("wheels", {"max_velocity": 0.1}),)
    _, night = asked(tmp_path, {**DAY, "dark": 0.8})
    assert values(night) == (["camera", "infrared"], "silent", 0.26)
    assert night.changes == (ChangeState("drive", Transition.DEACTIVATE),)
    _, empty = asked(tmp_path, {**DAY, "dark": 0.8, "charge": 0.1})
    assert values(empty) == (["camera", "infrared"], "silent", 0.26)


def test_a_fault_excludes_alternatives_and_is_named_as_the_reason(tmp_path: Path) -> None:
    question, choice = asked(tmp_path, {**DAY, "dark": 0.99})
    assert question.faults == ("lens_dusty",)
    assert values(choice)[0] == ["microphone", "infrared"]
    assert [(each.slot, each.alternative, each.why) for each in choice.explanation.excluded] == [
        ("senses", "camera", "fault lens_dusty")
    ]


def test_what_a_fault_prescribes_comes_first(tmp_path: Path) -> None:
    _, choice = asked(tmp_path, {**DAY, "hot": 30.0})
    assert values(choice)[1:] == ("silent", 0.1)


def test_what_is_prescribed_is_chosen_though_the_utility_of_that_alone_is_unknown(tmp_path: Path) -> None:
    text = RESCUER.replace("seeing * sight +", "(seeing if wheels.speed > 0.2 else lost) * sight +")
    text = text.replace("choices:\n", "  lost:    {topic: lost, field: share}\nchoices:\n", 1)
    question, choice = asked(tmp_path, {**DAY, "hot": 30.0}, text)
    assert values(choice)[1:] == ("silent", 0.1)
    assert choice.utility is None
    assert not any("the prescribed solution is not possible" in note for note in question.notes)
    assert any("lost is not known" in note for note in question.notes)
    lines = list(choice_lines(question.decision, question, choice))
    assert lines[0].endswith("utility unknown")
    _, choice = asked(tmp_path, DAY, text)
    assert values(choice)[2] == 0.26


@pytest.mark.parametrize("speed", [0.1, 0.26])
def test_where_the_utility_is_unknown_what_is_not_prescribed_stays(tmp_path: Path, speed: float) -> None:
    text = RESCUER.replace("{radio: silent, speed: 0.1}", "{radio: silent}").replace("utility: seeing", "utility: lost")
    text = text.replace("choices:\n", "  lost:    {topic: lost, field: share}\nchoices:\n", 1)
    now = wheeled()
    wheels = now.components["wheels"]
    now = now.with_component(replace(wheels, parameters={**wheels.parameters, "max_velocity": speed}))
    question = question_of(read_decision(written(tmp_path, text)), {**DAY, "hot": 30.0}, ClassEstimates(now))
    choice = question.choose(now, BranchAndBound())
    assert values(choice)[1:] == ("silent", speed)
    assert not any(isinstance(change, SetParameters) for change in choice.changes)


def test_what_is_prescribed_where_several_may_be_chosen_is_some_of_it_and_nothing_else(tmp_path: Path) -> None:
    text = RESCUER.replace("{radio: silent, speed: 0.1}", "{senses: [microphone, infrared]}")
    _, choice = asked(tmp_path, {**DAY, "hot": 30.0}, text)
    assert values(choice)[0] == ["microphone", "infrared"]
    lone = text.replace("[microphone, infrared]", "microphone").replace("bounds: {sight: {at_least: 1}}", "margin: 0")
    _, choice = asked(tmp_path, {**DAY, "hot": 30.0}, lone)
    assert values(choice)[0] == ["microphone"]


def test_a_prescribed_solution_that_is_not_possible_gives_way_and_that_is_said(tmp_path: Path) -> None:
    text = RESCUER + "  mute:\n    when: dark < 0.2\n    excludes: {radio: silent}\n"
    question, choice = asked(tmp_path, {**DAY, "hot": 30.0}, text)
    assert values(choice)[1] == "talking"
    assert any("the prescribed solution is not possible" in note for note in question.notes)


def test_a_fault_whose_condition_is_not_known_counts_as_absent_and_is_said(tmp_path: Path) -> None:
    for unknown in ({}, {"hot": float("nan")}, {"hot": float("inf")}):
        question, choice = asked(tmp_path, {"dark": 0.1, "charge": 0.9, **unknown})
        assert question.faults == ()
        assert values(choice)[1] == "talking"
        assert any(note.startswith("fault overheated counts as absent: hot is") for note in question.notes)


def test_a_limit_that_is_not_known_allows_nothing_and_is_named(tmp_path: Path) -> None:
    _, choice = asked(tmp_path, {"dark": 0.1, "hot": 1.0})
    assert choice.option is None
    assert "power at most 4.0 if charge > 0.5 else 3.0, of which charge is not known" in choice.explanation.nothing


def test_qualities_are_predicted_before_and_after(tmp_path: Path) -> None:
    _, choice = asked(tmp_path, DAY)
    assert [(each.name, each.after) for each in choice.explanation.predicted] == [("sight", 3.0), ("reach", 3.0)]


def test_every_planner_can_express_faults_of_components_and_requirements(tmp_path: Path) -> None:
    text = RESCUER.replace("hot:     {topic: power, field: consumers.motion}", "hot: {fault: wheels}")
    plain, decision = (read_decision(written(tmp_path, each)) for each in (RESCUER, text))
    assert list(not_predicted(decision)) == []
    assert list(not_learned(decision)) == list(not_learned(plain))


def test_what_a_planner_cannot_express_is_said(tmp_path: Path) -> None:
    decision = read_decision(written(tmp_path, RESCUER))
    assert [each.field for each in not_learned(decision)] == ["qualities", "qualities.reach", "objective.utility"]
    assert list(not_predicted(decision)) == []
    text = RESCUER.replace("reach: {estimated: total.reach}", "reach: {measured: dark}")
    assert [each.field for each in not_predicted(read_decision(written(tmp_path, text)))] == ["qualities.reach"]


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        ("context:", "contxt:", "1: contxt: there is no such field; did you mean 'context'?"),
        ("topic: light, ", "", "2: context.dark: must have one of topic, requirement, fault, request; has none"),
        ("{topic: power, field: consumers.motion}", "{fault: wheels, stale_after: 1}", "4: context.hot.stale_after"),
        ("field: charge}", "feild: charge}", "3: context.charge.feild: there is no such field; did you mean 'field'?"),
        ("field: charge}", "field: charge, reduce: men}", "3: context.charge.reduce: must be one of: abs, norm"),
        ("[0, 2]", "[3, 2]", "7: choices.senses.choose: is [3, 2], must be a number, or [least, most]"),
        ("sight: 3,", "sight: high,", "9: choices.senses.alternatives.camera.figures.sight: must be a number"),
        ("state: inactive", "state: idle", "14: choices.radio.alternatives.silent.set.0.state: 'idle' must be one of"),
        ("values: [0.1, 0.26]", "values: [0.1, 0.1]", "18: choices.speed.values.1: 0.1 is given twice"),
        ("values: [0.1, 0.26]", "valus: [0.1]", "18: choices.speed: must have 'alternatives', or one of values"),
        ("{radio: talking}", "{radio: taking}", "20: constraints.0.if.radio: 'taking' is none of its choices"),
        ("then: {senses:", "then: {sense:", "20: constraints.0.then.sense: there is no choice 'sense'; did you mean"),
        ("limit: power", "limit: powr", "21: constraints.1.limit: there is no figure 'powr'; did you mean 'power'?"),
        ("or dark < 0.5", "or drak < 0.5", "22: constraints.2.require: nothing is called 'drak' here; did you mean"),
        ("or dark < 0.5", "or dark <", "22: constraints.2.require: 'wheels.speed < 0.3 or dark <' is no expression"),
        ("seeing * sight", "seing * sight", "27: objective.utility: nothing is called 'seing' here; did you mean"),
        ("  sight: total.sight", "  dark: total.sight", "24: qualities.dark: 'dark' is the name of context"),
        ("  utility:", "  utilty:", "26: objective.utility: is missing"),
        ("2.0 if dark", "seeing if dark", "28: objective.weights.seeing: nothing is called 'seeing' here"),
        ("bounds: {sight:", "bounds: {sigt:", "29: objective.bounds.sigt: there is no quality 'sigt'; did you mean"),
        ("    excludes: {senses: camera}", "    excludes: {senses: camra}", "33: faults.lens_dusty.excludes.senses"),
        ("    when: dark > 0.95\n", "", "31: faults.lens_dusty.when: is missing"),
        ("dark > 0.95", "wheels.speed > 1", "32: faults.lens_dusty.when: wheels.speed is an estimate, and nothing is"),
        ("if charge > 0.5", "if wheels.speed > 1", "21: constraints.1.at_most: wheels.speed is an estimate"),
        ("faults:", "triggers: {every: 0}\nfaults:", "30: triggers.every: 0: must be at least 0.01"),
        ("faults:", "triggers: {on_requirement: [Safe]}\nfaults:", "30: triggers.on_requirement.0: 'Safe' is no"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_by_file_line_and_field(tmp_path: Path, right: str, wrong: str, told: str) -> None:
    assert right in RESCUER
    with pytest.raises(StackError) as refused:
        read_decision(written(tmp_path, RESCUER.replace(right, wrong, 1)))
    file = tmp_path / "rescue.yaml"
    assert any(line.startswith(f"{file}:{told}") for line in str(refused.value).splitlines()), str(refused.value)


def test_alternatives_of_which_no_two_go_together_cannot_be_chosen_two_at_a_time(tmp_path: Path) -> None:
    pace = "{set: {component: wheels, parameter: max_velocity, value: %s}}"
    text = f"choices:\n  pace:\n    choose: 2\n    alternatives: {{slow: {pace % 0.1}, fast: {pace % 0.2}}}\n"
    with pytest.raises(StackError, match=r"yaml:2: choices\.pace: leaves nothing to choose: its alternatives want"):
        read_decision(written(tmp_path, text + "objective: {utility: 1}\n"))


def test_all_mistakes_are_named_at_once(tmp_path: Path) -> None:
    text = RESCUER.replace("topic: light, ", "").replace("limit: power", "limit: powr").replace("seeing *", "sing *")
    with pytest.raises(StackError) as refused:
        read_decision(written(tmp_path, text))
    assert [problem.line for problem in refused.value.problems] == [2, 21, 27]


@pytest.mark.parametrize("text", ["", "[1, 2]", "choices: {a: [1]}", "choices: 3", "context: {a: {topic: [x]}}", "\t:"])
def test_a_file_of_any_other_form_is_refused_without_a_crash(tmp_path: Path, text: str) -> None:
    with pytest.raises(StackError):
        read_decision(written(tmp_path, text))


@pytest.mark.parametrize("seed", range(150))
def test_a_damaged_file_is_refused_or_read_and_never_crashes_the_reader(tmp_path: Path, seed: int) -> None:
    rng = Random(f"damage {seed}")
    lines = RESCUER.splitlines()
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(lines))
        words = re.split(r"([\s:{},\[\]]+)", lines[at])
        words[rng.randrange(len(words))] = rng.choice(ODD)
        lines[at] = "".join(words)
    try:
        decision = read_decision(written(tmp_path, "\n".join(lines) + "\n"))
    except StackError as error:
        assert all(problem.file.endswith("rescue.yaml") for problem in error.problems)
        return
    now = wheeled()
    try:
        question_of(decision, DAY, ClassEstimates(now)).choose(now, BranchAndBound())
    except BadMessage as error:
        assert str(error)
