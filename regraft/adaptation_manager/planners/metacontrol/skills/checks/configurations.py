"""Configurations of components: their names are lifecycle states, and each has one set of parameters."""

from __future__ import annotations

import math

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Findings
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import REACHABLE, STATES, every_component, mode_name
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import (
    ACTIVE,
    Configuration,
    Parameter,
    Place,
    SkillSet,
    Value,
)
from regraft.bus_schema.suggestions import Hints

INT64 = 2**63
Typed = frozenset[tuple[str, str, Value | None]]


def check(skills: SkillSet, findings: Findings) -> None:
    """Note configurations that are no states, have two sets of parameters, or set what cannot be set."""
    hints = Hints(STATES)
    first: dict[tuple[str, str], tuple[Typed, Place, str]] = {}
    for component in every_component(skills):
        for each in component.configurations:
            _check_name(each, hints, findings)
            for parameter in each.parameters or ():
                _check_value(parameter, findings)
            if each.is_active and each.parameters is not None:
                _check_same(component.name, each, first, findings)
            elif each.parameters and not each.is_active:
                problem = f"the parameters of {each.name!r} have no effect: only active configurations set any"
                findings.warning(each.place, Code.PARAMETERS_IGNORED, problem)
    for realization in skills.realizations:
        for component in realization.components:
            target = component.target
            if len(component.configurations) > 1:
                problem = f"{component.name!r} has several configurations here: {target.name!r} is used"
                findings.warning(component.place, Code.SEVERAL_CONFIGURATIONS, problem)
            if target.state in STATES and target.state not in REACHABLE:
                problem = f"no component stays in {target.state!r}: {realization.name!r} is unrealisable, left out of"
                findings.warning(target.place, Code.UNREALISABLE, f"{problem} all that is generated")


def _check_name(configuration: Configuration, hints: Hints, findings: Findings) -> None:
    name, state = configuration.name, configuration.state
    if state in STATES and (state == ACTIVE or not configuration.mode):
        return
    if state in STATES:
        problem = f"{name!r}: only 'active' has modes: must be {state!r} or 'active.{configuration.mode}'"
    else:
        problem = f"{name!r} is no lifecycle state: must be one, or active.MODE; {hints.instead_of(state)}"
    findings.error(configuration.place, Code.NO_STATE, problem)


def _check_value(parameter: Parameter, findings: Findings) -> None:
    value = parameter.value
    if value is None:
        findings.warning(parameter.place, Code.VALUE_IGNORED, f"{parameter.name!r} has no value: it is not set")
    elif parameter.ignored is not None:
        problem = f"{parameter.name!r} has a text and a number: the number {parameter.ignored:g} is ignored"
        findings.warning(parameter.place, Code.VALUE_IGNORED, problem)
    if isinstance(value, int) and not isinstance(value, bool) and not -INT64 <= value < INT64:
        problem = f"{parameter.name!r}: {str(value)[:40]} does not fit into 64 bits: write it with a point"
        findings.error(parameter.place, Code.BAD_NUMBER, problem)
    if isinstance(value, float) and not math.isfinite(value):
        problem = f"{parameter.name!r} is out of range: numbers go to about 1.8e308"
        findings.error(parameter.place, Code.BAD_NUMBER, problem)


def _check_same(
    component: str,
    configuration: Configuration,
    first: dict[tuple[str, str], tuple[Typed, Place, str]],
    findings: Findings,
) -> None:
    given = typed(configuration.parameters or ())
    key = (component, mode_name(configuration))
    known, place, name = first.setdefault(key, (given, configuration.place, configuration.name))
    if given != known:
        differ = ", ".join(sorted({each[0] for each in given ^ known}))
        problem = f"{configuration.name!r} of {component!r} has other parameters than {name!r} in {place}: {differ}"
        findings.error(configuration.place, Code.DIFFERENT_PARAMETERS, problem)


def typed(parameters: tuple[Parameter, ...]) -> Typed:
    """Return values that differ also where their types do: system_modes compares both."""
    return frozenset((each.name, type(each.value).__name__, each.value) for each in parameters)
