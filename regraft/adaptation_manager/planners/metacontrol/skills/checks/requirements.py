"""Skills that realizations require, and the qualities that these must have then."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.checks.qualities import range_problem
from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Findings
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import (
    Better,
    Bound,
    Place,
    QualityType,
    Skill,
    SkillSet,
)
from regraft.bus_schema.suggestions import Hints

MAX_CIRCLES: Final = 20
"""Circles that are reported: of many, one may be the cause."""


def check(skills: SkillSet, findings: Findings) -> None:
    """Note requirements of no skill, bounds of no quality, and skills that require themselves."""
    by_name = {each.name: each for each in skills.skills}
    types = {each.name: each for each in skills.qualities}
    hints = Hints(by_name)
    listed = {name: _Listed(skill) for name, skill in by_name.items()}
    needs: dict[str, dict[str, Place]] = {}
    for realization in skills.realizations:
        for each in realization.requirements:
            if each.skill not in by_name:
                problem = f"there is no skill {each.skill!r}; {hints.instead_of(each.skill)}"
                findings.error(each.place, Code.UNKNOWN_SKILL, problem)
                continue
            needs.setdefault(realization.skill, {}).setdefault(each.skill, each.place)
            for bound in each.bounds:
                _check_bound(bound, listed[each.skill], types.get(bound.quality), findings)
    _check_circles(needs, findings)


class _Listed:
    """The qualities that a skill lists, looked up often."""

    def __init__(self, skill: Skill) -> None:
        self.skill = skill.name
        self.names = frozenset(each.text for each in skill.qualities)
        self.hints = Hints(self.names)


def _check_bound(bound: Bound, required: _Listed, quality: QualityType | None, findings: Findings) -> None:
    if bound.quality not in required.names:
        problem = f"the skill {required.skill!r} does not list the quality {bound.quality!r}; "
        findings.error(bound.place, Code.QUALITY_NOT_LISTED, problem + required.hints.instead_of(bound.quality))
        return
    wrong = range_problem(quality, bound.value)
    if wrong:
        findings.error(bound.place, wrong[0], f"{bound.quality}: {wrong[1]}")
    better = quality.better if quality else None
    right = {Better.HIGHER: ">=", Better.LOWER: "<="}.get(better) if better else bound.operator
    if better is not None and bound.operator != right:
        problem = f"{bound.quality!r} is better when {better.value}: the bound must be {right}, is {bound.operator}"
        findings.error(bound.place, Code.WRONG_DIRECTION, problem)


def _check_circles(needs: dict[str, dict[str, Place]], findings: Findings) -> None:
    """Note each requirement that closes a circle of skills, in one walk over all."""
    done: set[str] = set()
    closing = (each for start in needs for each in _closing(start, needs, done))
    for way, place in islice(closing, MAX_CIRCLES):
        problem = f"the skill {way[0]!r} requires itself: {' > '.join(way)}"
        findings.error(place, Code.REQUIREMENT_CIRCLE, problem)


def _closing(start: str, needs: dict[str, dict[str, Place]], done: set[str]) -> Iterator[tuple[tuple[str, ...], Place]]:
    """Yield the way of each circle that is found from a skill, and the place of its last requirement."""
    if start in done:
        return
    way: dict[str, Iterator[tuple[str, Place]]] = {start: iter(needs.get(start, {}).items())}
    while way:
        skill = next(reversed(way))
        step = next(way[skill], None)
        if step is None:
            done.add(skill)
            del way[skill]
        elif step[0] in way:
            names = list(way)
            yield (*names[names.index(step[0]) :], step[0]), step[1]
        elif step[0] not in done:
            way[step[0]] = iter(needs.get(step[0], {}).items())
