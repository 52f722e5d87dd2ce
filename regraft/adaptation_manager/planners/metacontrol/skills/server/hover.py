"""Describes the word at a place: a skill, a quality, a realization, a component or a context."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import Curve, curve_problem
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import CONTEXTS, every_component, expected, is_rest
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import QualityType, Realization, Skill, SkillSet

WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_/-]*")
MAX_SHOWN: Final = 4000
"""Characters of what is shown."""


def word_at(text: str, offset: int) -> str:
    """Return the word at an offset of a text, empty if there is none."""
    start = text.rfind("\n", 0, offset) + 1
    end = text.find("\n", offset)
    line = text[start : len(text) if end < 0 else end]
    return next((each[0] for each in WORD.finditer(line) if each.start() <= offset - start <= each.end()), "")


def described(skills: SkillSet, word: str) -> str:
    """Return what is known of a word, as plain text; empty if nothing is."""
    found = "\n\n".join("\n".join(part) for part in _parts(skills, word))
    return found if len(found) <= MAX_SHOWN else f"{found[:MAX_SHOWN]}…"


def _parts(skills: SkillSet, word: str) -> Iterator[list[str]]:
    skill = skills.skill(word)
    if skill is not None:
        yield list(_skill(skills, skill))
    quality = skills.quality(word)
    if quality is not None:
        yield list(_quality(quality))
    for each in skills.realizations:
        if each.name == word:
            yield list(_realization(each))
    modes = dict.fromkeys(
        one.name for each in every_component(skills) if each.name == word for one in each.configurations
    )
    if modes:
        yield [f"Component {word}", f"configurations: {', '.join(modes)}"]
    if word in CONTEXTS or any(each.text == word for each in skills.contexts):
        count = sum(1 for each in skills.realizations if each.context.text == word)
        yield [f"Context {word}", f"realizations: {count}"]


def _skill(skills: SkillSet, skill: Skill) -> Iterator[str]:
    yield f"Skill {skill.name}"
    yield f"qualities: {', '.join(each.text for each in skill.qualities)}"
    for kind, fields in (("inputs", skill.inputs), ("outputs", skill.outputs)):
        if fields:
            yield f"{kind}: {', '.join(f'{each.name}: {each.type}' for each in fields)}"
    realizations = skills.realizations_of(skill.name)
    if realizations:
        yield f"realizations: {', '.join(each.name for each in realizations)}"


def _quality(quality: QualityType) -> Iterator[str]:
    yield f"Quality {quality.name}"
    yield f"better: {quality.better.value}"
    if quality.low is not None and quality.high is not None:
        yield f"range: {quality.low:g}..{quality.high:g}"
    if quality.weight is not None:
        yield f"weight: {quality.weight:g}"
    if quality.curve is not None and not curve_problem(quality.curve):
        yield f"curve: [{Curve(quality.curve)}]"
    if quality.measured is not None:
        yield f"measured: {quality.measured}"


def _realization(realization: Realization) -> Iterator[str]:
    of = f" of {realization.skill}" if realization.skill else ""
    yield f"Realization {realization.name}{of}{' (rest: it is never chosen)' if is_rest(realization) else ''}"
    estimates = expected(realization)
    if estimates:
        yield f"estimates: {', '.join(f'{name} {value:g}' for name, value in estimates.items())}"
    for each in realization.requirements:
        bounds = ", ".join(f"{bound.quality} {bound.operator} {bound.value:g}" for bound in each.bounds)
        yield f"requires {each.skill}{f' [{bounds}]' if bounds else ''}"
    yield f"context: {realization.context.text}"
