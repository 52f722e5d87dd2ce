"""Realizations: the skill and context of each, and the one that is the configuration of rest."""

from __future__ import annotations

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Findings
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import (
    CONTEXTS,
    DEFAULT_CONTEXT,
    STATES,
    is_realisable,
    is_rest,
)
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Realization, SkillSet
from regraft.bus_schema.suggestions import Hints


def check(skills: SkillSet, findings: Findings) -> None:
    """Note realizations of no skill or context, and skills that nothing realizes normally."""
    names = {each.name for each in skills.skills}
    skill_hints = Hints(names)
    contexts = {*CONTEXTS, *(each.text for each in skills.contexts)}
    context_hints = Hints(contexts)
    for each in skills.realizations:
        _check_skill(each, names, skill_hints, findings)
        if each.context.text not in contexts:
            problem = f"there is no context {each.context.text!r}; {context_hints.instead_of(each.context.text)}"
            findings.error(each.context.place, Code.UNKNOWN_CONTEXT, problem)
        if is_rest(each) and any(component.is_active for component in each.components):
            problem = f"{each.name!r} is the configuration of rest by its name: it is never chosen"
            findings.warning(each.place, Code.NEVER_CHOSEN, f"{problem}; a name without 'default' makes it a choice")
    by_skill: dict[str, list[Realization]] = {}
    for each in skills.realizations:
        by_skill.setdefault(each.skill, []).append(each)
    for skill in skills.skills:
        own = by_skill.get(skill.name, [])
        _check_rest(own, findings)
        choices = [each for each in own if not is_rest(each) and is_realisable(each)]
        # A misspelt state or context is reported as such: it may be the one that is missing.
        unclear = any(each.context.text not in contexts or not _has_states(each) for each in own)
        if own and not unclear and not any(each.context.text == DEFAULT_CONTEXT for each in choices):
            problem = f"no realization of {skill.name!r} can be chosen in the context {DEFAULT_CONTEXT!r}: add one"
            findings.error(skill.place, Code.NO_DEFAULT_CONTEXT, problem)


def _has_states(realization: Realization) -> bool:
    return all(each.target.state in STATES for each in realization.components)


def _check_skill(realization: Realization, names: set[str], hints: Hints, findings: Findings) -> None:
    of = realization.of
    if not realization.skill:
        problem = f"{realization.name!r} stands alone: must be in a skill, or have 'of SKILL' behind its name"
        findings.error(realization.place, Code.NO_SKILL, problem)
    elif of is not None and of.text != realization.skill:
        problem = f"{realization.name!r} is in the skill {realization.skill!r}: leave out 'of {of.text}'"
        findings.error(of.place, Code.OTHER_SKILL, problem)
    elif of is not None and realization.skill not in names:
        problem = f"there is no skill {of.text!r}; {hints.instead_of(of.text)}"
        findings.error(of.place, Code.UNKNOWN_SKILL, problem)


def _check_rest(realizations: list[Realization], findings: Findings) -> None:
    rests = [each for each in realizations if is_rest(each)]
    for each in rests[1:]:
        problem = f"{each.name!r} is a second configuration of rest, next to {rests[0].name!r} in {rests[0].place}"
        findings.error(each.place, Code.REST_TWICE, f"{problem}: leave one out")
