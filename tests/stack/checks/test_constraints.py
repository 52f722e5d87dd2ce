"""A stack's own constraints: expressions over parameters, services that must be there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from regraft.bus_schema.model.architecture import Architecture, Constraint, ConstraintKind
from regraft.bus_schema.model.consistency import violations
from regraft.bus_schema.model.lifecycle import State
from regraft.stack import load
from tests.adaptation.system import small_architecture
from tests.stack.reading.files import changed, line_of, problems, write


def _problems(architecture: Architecture) -> list[str]:
    return [f"{violation.field}: {violation.problem}" for violation in violations(architecture)]


def _with(*constraints: Constraint, **gains: float) -> Architecture:
    architecture = small_architecture(constraints)
    for name, gain in gains.items():
        architecture = architecture.with_component(replace(architecture.components[name], parameters={"gain": gain}))
    return architecture


def _require(expression: str, because: str = "") -> Constraint:
    return Constraint(ConstraintKind.REQUIRE, expression=expression, because=because)


def test_an_expression_that_does_not_hold_is_told_with_the_values_that_there_are() -> None:
    sum_of_gains = _require("listener.gain + second.gain <= 1.0", "it hurts")
    assert _problems(_with(sum_of_gains)) == []
    assert _problems(_with(sum_of_gains, listener=0.75)) == [
        "constraints.0: 'listener.gain + second.gain <= 1.0' must be so, but listener.gain is 0.75, "
        "second.gain is 0.5, because it hurts"
    ]


def test_an_expression_knows_who_is_active_and_demands_nothing_of_who_is_not_there() -> None:
    scanner_off = _require("not scanner.active or listener.gain > 0.9")
    architecture = _with(scanner_off)
    assert _problems(architecture) == []
    scanning = architecture.with_component(replace(architecture.components["scanner"], state=State.ACTIVE))
    assert len(_problems(scanning)) == 1
    assert _problems(_with(_require("nobody.gain > 0.9"), _require("not nobody.active"))) == []
    assert len(_problems(_with(_require("known(nobody.gain, 0.5) > 0.9")))) == 1


def test_an_expression_of_what_does_not_fit_is_a_violation() -> None:
    (unknown,), (mixed,) = (_problems(_with(_require(text))) for text in ("listener.gian > 0", "listener.label > 0"))
    assert "listener has no parameter 'gian'; did you mean 'gain'?" in unknown
    assert "'listener.label > 0': '>' not supported between" in mixed
    (bare,) = _problems(_with(_require("gain > 0")))
    assert "'gain' has no place in a constraint: must be 'component.parameter'" in bare


def test_a_service_that_must_be_provided_is_offered_by_somebody_active() -> None:
    wanted = Constraint(ConstraintKind.PROVIDED, services=("scan/again", "sing"), because="we look twice")
    architecture = _with(wanted)
    scanner = replace(architecture.components["scanner"], services={"again": "scan/again"}, cls="", command=("x",))
    problems = _problems(architecture.with_component(scanner))
    assert "service 'scan/again' must be offered by an active component, but is not: activate scanner" in problems[0]
    assert "service 'sing' must be offered by an active component, but is not: nobody has it" in problems[1]
    active = architecture.with_component(replace(scanner, state=State.ACTIVE))
    assert [problem for problem in _problems(active) if "scan/again" in problem] == []


def test_several_violations_are_told_at_once() -> None:
    constraints = (_require("listener.gain > 0.9"), _require("second.gain > 0.9"))
    assert len(_problems(_with(*constraints))) == 2


LIMIT = "  - parameter: "


def test_a_stack_file_has_them_and_is_held_to_them(tmp_path: Path) -> None:
    extra = "  - {require: rescuer.navigator.max_velocity * 2 < 1, because: we like it}\n  - {provided: [sing]}\n"
    text = changed((LIMIT, extra + LIMIT))
    (missing,) = problems(tmp_path, text)
    assert missing.line == line_of(text, "provided")
    assert missing.problem == "service 'sing' must be offered by an active component, but is not: nobody has it"
    stack = load(write(tmp_path, text.replace("  - {provided: [sing]}\n", "")))
    assert stack.architecture.constraints[-2].expression == "rescuer.navigator.max_velocity * 2 < 1"


def test_what_cannot_be_read_leaves_the_others_in_their_places(tmp_path: Path) -> None:
    text = changed((LIMIT, "  - {require: 'a ** 2'}\n  - {require: ''}\n  - {provided: [sing]}\n" + LIMIT))
    power, empty, missing = problems(tmp_path, text)
    assert (power.line, power.field) == (line_of(text, "a ** 2"), "constraints.1.require")
    assert (empty.line, empty.field) == (line_of(text, "require: ''"), "constraints.2.require")
    assert (missing.line, missing.field) == (line_of(text, "provided"), "constraints.3")


@pytest.mark.parametrize(
    ("constraint", "problem"),
    [
        ("{require: rescuer.navigator.max_velocity >}", "'rescuer.navigator.max_velocity >' is no expression"),
        ("{require: max_velocity > 0}", "'max_velocity' has no place in a constraint"),
        ("{require: 5}", "must be a condition, such as: navigator.max_velocity < 0.2"),
        (
            "{require: rescuer.navigator.max_velocity}",
            "is a number, must be true or false, such as: rescuer.navigator.",
        ),
        ("{require: rescuer.navigator.active and 1}", "1 is a number, must be true or false"),
        ("{require: rescuer.navigator.planner > 3}", "rescuer.navigator.planner, a text, is compared with 3, a number"),
        ("{require: 1 < 2}", "speaks of no 'component.parameter'"),
        ("{require: rescuer.navigato.max_velocity > 0}", "there is no component 'rescuer.navigato'; did you mean"),
        ("{require: rescuer.navigator.max_speed > 0}", "has no parameter 'max_speed'"),
        ("{provided: []}", "must list services"),
    ],
)
def test_one_that_cannot_be_is_told_with_its_line(tmp_path: Path, constraint: str, problem: str) -> None:
    text = changed((LIMIT, f"  - {constraint}\n{LIMIT}"))
    (found,) = problems(tmp_path, text)
    assert found.line == line_of(text, constraint)
    assert problem in found.problem
