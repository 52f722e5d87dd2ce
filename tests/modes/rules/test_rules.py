"""Rules of stack files: read, or refused with file, line and field, and what would be right."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.stack import StackError, load
from regraft.stack.yaml.problems import Problem
from tests.modes.stacks import MODES, RULES, SIMULATED, STACK, write


def _problems(folder: Path, text: str) -> tuple[Problem, ...]:
    with pytest.raises(StackError) as caught:
        load(write(folder, text))
    return caught.value.problems


def test_rules_are_read_in_their_order(tmp_path: Path) -> None:
    degrade, recover = load(write(tmp_path)).architecture.mode_rules
    assert (degrade.name, degrade.mode, degrade.start) == ("degrade", "degraded", ())
    assert recover == ModeRule("recover", "not laser.failed and laser.state != 'gone'", "normal", ("degraded",))


@pytest.mark.parametrize(
    ("right", "wrong", "field", "problem"),
    [
        ("mode: degraded", "mode: degarded", "rules.degrade.mode", "did you mean 'degraded'?"),
        ("from: degraded", "from: [degarded]", "rules.recover.from", "did you mean 'degraded'?"),
        ("from: degraded", "from: normal", "rules.recover.from", "is the mode that it leads to"),
        ("when: laser.failed or", "when: lasr.failed or", "rules.degrade.when", "did you mean 'laser'?"),
        ("when: laser.failed or", "when: laser.faild or", "rules.degrade.when", "did you mean 'failed'?"),
        ("when: laser.failed or", "when: laser.failed or or", "rules.degrade.when", "is no expression"),
        ("laser.state == 'gone'", "laser.state == 'gonne'", "rules.degrade.when", "did you mean 'gone'?"),
        ("when: laser.failed or", "when: mode == 'degarded' or", "rules.degrade.when", "did you mean 'degraded'?"),
        ("when: laser.failed or", "when: laser.clearness < 'a' or", "rules.degrade.when", "the text 'a', and is none"),
        ("when: laser.failed or", "when: qualities.Safe.degre < 1 or", "rules.degrade.when", "qualities.Safe.degree"),
        ("when: laser.failed or", "when: 5 or", "rules.degrade.when", "5 is a number, must be true or false, such as:"),
        ("when: laser.failed or", "when: laser.clearness or", "rules.degrade.when", "such as: laser.clearness > 0"),
        ("when: laser.failed or", "when: laser.state or", "rules.degrade.when", "laser.state is a text, must be true"),
        ("when: laser.failed or laser.state == 'gone'", "when: 5", "rules.degrade.when", "such as: laser.failed"),
        ("when: laser.failed or laser.state == 'gone'", "when: true", "rules.degrade.when", "such as: laser.failed"),
        ("    because:", "    dwel: 1\n    because:", "rules.degrade.dwel", "did you mean 'dwell'?"),
        ("    because:", "    settle: -1\n    because:", "rules.degrade.settle", "must be at least 0"),
        ("    mode: normal\n", "", "rules.recover.mode", "is missing"),
        ("    because:", "    from: laser.x\n    because:", "rules.degrade.from", "there is no mode 'laser.x'"),
    ],
)
def test_a_rule_that_cannot_be_is_refused_in_its_place(
    tmp_path: Path, right: str, wrong: str, field: str, problem: str
) -> None:
    assert right in RULES
    (found,) = _problems(tmp_path, STACK + MODES + RULES.replace(right, wrong, 1))
    assert (found.field, Path(found.file).name) == (field, "stack.yaml")
    assert found.line
    assert problem in found.problem


def test_the_name_of_a_mode_may_stand_for_whether_there_is_one(tmp_path: Path) -> None:
    text = RULES.replace("when: laser.failed or", "when: not target or laser.failed or")
    assert len(load(write(tmp_path, STACK + MODES + text)).architecture.mode_rules) == 2


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("mode == 'normal'", "mode == 'degraded'"),
        ("laser.active", "laser.state == 'inactive'"),  # which the modes themselves change
        ("driver.failed and target != 'degraded'", "driver.failed and target != 'normal'"),
    ],
)
def test_rules_that_lead_in_a_circle_are_refused_with_the_modes(tmp_path: Path, first: str, second: str) -> None:
    rules = f'rules:\n  down: {{when: "{first}", mode: degraded}}\n  up: {{when: "{second}", mode: normal}}\n'
    (found,) = _problems(tmp_path, STACK + MODES + rules)
    assert found.field == "rules.up"
    assert "leads in a circle with 'down': " in found.problem
    assert "normal > degraded > normal" in found.problem or "degraded > normal > degraded" in found.problem


@pytest.mark.parametrize(("settle", "is_circle"), [(9.9, True), (10.0, False)])
def test_a_rule_that_settles_for_ten_seconds_may_try_again_what_had_failed(
    tmp_path: Path, settle: float, is_circle: bool
) -> None:
    again = f"{{when: not laser.active, from: degraded, mode: normal, settle: {settle}}}"
    rules = f"rules:\n  again: {again}\n  down: {{when: laser.failed, mode: degraded}}\n"
    text = STACK + MODES + rules
    if is_circle:
        (found,) = _problems(tmp_path, text)
        assert "leads in a circle with 'again': " in found.problem
    else:
        assert len(load(write(tmp_path, text)).architecture.mode_rules) == 2


@pytest.mark.parametrize("when", ["laser.failed", "driver.active", "laser.clearness > 0.3"])
def test_rules_that_hold_together_lead_in_no_circle_for_the_first_one_counts(tmp_path: Path, when: str) -> None:
    text = RULES.replace("not laser.failed and laser.state != 'gone'", when)
    assert len(load(write(tmp_path, STACK + MODES + text)).architecture.mode_rules) == 2


def test_rules_that_nobody_enforces_are_refused(tmp_path: Path) -> None:
    planner = SIMULATED[SIMULATED.index("  mode_planner:") : SIMULATED.index("modes:\n")]
    (found,) = _problems(tmp_path, SIMULATED.replace(planner, ""))
    assert found.field == "rules"
    assert "ModePlanner" in found.problem


def test_a_second_decider_is_refused(tmp_path: Path) -> None:
    planner = SIMULATED[SIMULATED.index("  mode_planner:") : SIMULATED.index("modes:\n")]
    (found,) = _problems(
        tmp_path, SIMULATED.replace(planner, planner + planner.replace("mode_planner:\n", "second:\n"))
    )
    assert found.field == "components.second.services.modes/decider"
    assert "one component that decides on modes, not 'mode_planner' and 'second'" in found.problem


def test_a_mode_has_the_changes_of_those_that_it_enters(tmp_path: Path) -> None:
    more = "  driver.slow:\n    - {change: set_parameters, component: driver, parameters: {speed: 0.1}}\n"
    more += "  night:\n    - {change: mode, mode: driver.slow}\n"
    architecture = load(write(tmp_path, STACK + MODES + more + RULES)).architecture
    assert architecture.modes["night"] == architecture.modes["driver.slow"]
    assert architecture.mode_parts == {"night": ("driver.slow",)}
