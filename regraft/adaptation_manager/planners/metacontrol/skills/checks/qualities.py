"""Qualities: their types, which of them a skill lists, and what realizations expect of them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping

from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import curve_problem
from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Findings
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import is_rest
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import (
    Environment,
    Estimate,
    Place,
    QualityType,
    Realization,
    Skill,
    SkillSet,
)
from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.expression_kinds import kind_problems
from regraft.bus_schema.model.expressions import Expression
from regraft.bus_schema.suggestions import Hints


def check(skills: SkillSet, findings: Findings) -> None:
    """Note wrong types, qualities that are not there, and estimates that no quality can have."""
    types = {each.name: each for each in skills.qualities}
    for each in skills.qualities:
        _check_type(each, findings)
    hints = Hints(types)
    for skill in skills.skills:
        for listed in skill.qualities if types else ():
            if listed.text not in types:
                problem = f"there is no quality {listed.text!r}; {hints.instead_of(listed.text)}"
                findings.error(listed.place, Code.UNKNOWN_QUALITY, problem)
    _check_weights(skills, types, findings)
    by_name = {each.name: each for each in skills.skills}
    listed_hints = {name: Hints(each.text for each in skill.qualities) for name, skill in by_name.items()}
    for realization in skills.realizations:
        owner = by_name.get(realization.skill)
        _check_estimates(realization, types, findings)
        if owner is not None:
            _check_listed(realization, owner, listed_hints[owner.name], findings)


def _check_weights(skills: SkillSet, types: Mapping[str, QualityType], findings: Findings) -> None:
    """Note skills whose realizations are all equally useful, as no quality of theirs has a weight."""
    choices = Counter(each.skill for each in skills.realizations if not is_rest(each))
    for skill in skills.skills if types else ():
        known = [types[each.text] for each in skill.qualities if each.text in types]
        if known and choices[skill.name] > 1 and not any(each.weight for each in known):
            problem = (
                f"no quality of the skill {skill.name!r} has a 'weight': its first realization that meets the bounds"
            )
            findings.warning(skill.place, Code.NO_WEIGHT, f"{problem} is taken")


def range_problem(quality: QualityType | None, value: float) -> tuple[Code, str] | None:
    """Return why a quality cannot have a value, None if it can."""
    if not math.isfinite(value):
        return Code.BAD_NUMBER, "is out of range: numbers go to about 1.8e308"
    low = -math.inf if quality is None or quality.low is None else quality.low
    high = math.inf if quality is None or quality.high is None else quality.high
    if low <= value <= high:
        return None
    return Code.OUT_OF_RANGE, f"{value:g} is out of the quality's range: must be from {low:g} to {high:g}"


def _check_type(quality: QualityType, findings: Findings) -> None:
    at = {field.key: field.place for field in quality.fields}
    if quality.low is not None and quality.high is not None and not _is_range(quality.low, quality.high):
        problem = f"the range of {quality.name!r} is empty: must be LOW..HIGH, such as 0..1"
        findings.error(at["range"], Code.BAD_RANGE, problem)
    if quality.weight is not None and not 0.0 <= quality.weight < math.inf:
        problem = f"the weight of {quality.name!r} is {quality.weight:g}: must be 0 or more, and finite"
        findings.error(at["weight"], Code.BAD_WEIGHT, problem)
    problem = curve_problem(quality.curve) if quality.curve is not None else ""
    if problem:
        findings.error(at["curve"], Code.BAD_CURVE, f"the curve of {quality.name!r}: {problem}")
    if quality.measured is not None:
        try:
            problems = kind_problems(Expression(quality.measured), wanted=ValueKind.NUMBER)
        except BadMessage as error:
            problems = [str(error)]
        for problem in problems:
            findings.error(at["measured"], Code.BAD_EXPRESSION, f"'measured' of {quality.name!r}: {problem}")


def _is_range(low: float, high: float) -> bool:
    return math.isfinite(low) and math.isfinite(high) and low < high


def _check_listed(realization: Realization, skill: Skill, hints: Hints, findings: Findings) -> None:
    listed = {each.text for each in skill.qualities}
    estimated = {each.quality for each in realization.estimates}
    for each in realization.estimates:
        if each.quality not in listed:
            problem = f"the skill {skill.name!r} does not list the quality {each.quality!r}; "
            findings.error(each.place, Code.QUALITY_NOT_LISTED, problem + hints.instead_of(each.quality))
    missing = [each.text for each in skill.qualities if each.text not in estimated]
    if missing and not is_rest(realization):
        problem = f"{realization.name!r} has no estimate of: {', '.join(missing)}"
        findings.warning(realization.place, Code.NO_ESTIMATE, problem)


def _check_estimates(realization: Realization, types: dict[str, QualityType], findings: Findings) -> None:
    first: dict[tuple[str, tuple[Environment, ...]], tuple[float, Place]] = {}
    for each in realization.estimates:
        wrong = range_problem(types.get(each.quality), each.value)
        if wrong:
            findings.error(each.place, wrong[0], f"{each.quality}: {wrong[1]}")
        for environment in each.environments:
            for name, value in environment.values:
                if not math.isfinite(value):
                    problem = f"{environment.name}: {name} is out of range: numbers go to about 1.8e308"
                    findings.error(each.place, Code.BAD_NUMBER, problem)
        key = (each.quality, each.environments)
        if key in first:
            _note_twice(each, *first[key], findings)
        first.setdefault(key, (each.value, each.place))


def _note_twice(estimate: Estimate, value: float, place: Place, findings: Findings) -> None:
    if estimate.value == value:
        problem = f"the quality {estimate.quality!r} is given twice with {value:g}, first in {place}: leave one out"
        findings.warning(estimate.place, Code.QUALITY_TWICE, problem)
        return
    problem = f"the quality {estimate.quality!r} is {estimate.value:g} here and {value:g} in {place}: leave one out"
    findings.error(estimate.place, Code.QUALITY_TWICE, problem)
