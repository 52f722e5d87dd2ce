"""Names that are declared twice, that differ in case only, or that two kinds of things share."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Findings
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import CONTEXTS, every_component
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Name, Place, SkillSet

Named = tuple[str, Place]


def check(skills: SkillSet, findings: Findings) -> None:
    """Note names that are not distinct, and those that are easily confused."""
    for kind, named in _declared(skills):
        _check_unique(kind, named, findings)
    for kind, used in _alike(skills):
        _check_case(kind, used, findings)
    _check_shared(skills, findings)


def _declared(skills: SkillSet) -> Iterator[tuple[str, list[Named]]]:
    """Yield what is declared once, each with its kind."""
    yield "quality", [(each.name, each.place) for each in skills.qualities]
    yield "context", _of(skills.contexts)
    yield "skill", [(each.name, each.place) for each in skills.skills]
    yield "component", [(each.name, each.place) for each in skills.components]
    for quality in skills.qualities:
        yield "field", [(each.key, each.place) for each in quality.fields]
    for skill in skills.skills:
        yield "quality", _of(skill.qualities)
        yield "field", [(each.name, each.place) for each in (*skill.inputs, *skill.outputs)]
        yield "result", [(each.kind.value, each.place) for each in skill.results]
    yield from _of_realizations(skills)
    for component in every_component(skills):
        yield "configuration", [(each.name, each.place) for each in component.configurations]
        for configuration in component.configurations:
            yield "parameter", [(each.name, each.place) for each in configuration.parameters or ()]


def _of_realizations(skills: SkillSet) -> Iterator[tuple[str, list[Named]]]:
    by_skill: dict[str, list[Named]] = {}
    for realization in skills.realizations:
        by_skill.setdefault(realization.skill, []).append((realization.name, realization.place))
        yield "component", [(each.name, each.place) for each in realization.components]
        yield "required skill", [(each.skill, each.place) for each in realization.requirements]
        for requirement in realization.requirements:
            yield "bound of", [(each.quality, each.place) for each in requirement.bounds]
    for named in by_skill.values():
        yield "realization", named


def _alike(skills: SkillSet) -> Iterator[tuple[str, Iterable[Named]]]:
    """Yield names of one kind, as often as they are used."""
    predefined = [(name, each.place) for each in skills.contexts for name in CONTEXTS]
    listed = chain.from_iterable(skill.qualities for skill in skills.skills)
    yield "quality", chain(((each.name, each.place) for each in skills.qualities), _of(listed))
    yield "context", chain(predefined, _of(skills.contexts))
    yield "skill", ((each.name, each.place) for each in skills.skills)
    by_skill: dict[str, list[Named]] = {}
    for realization in skills.realizations:
        by_skill.setdefault(realization.skill, []).append((realization.name, realization.place))
    for named in by_skill.values():
        yield "realization", named
    yield "component", ((each.name, each.place) for each in every_component(skills))
    configurations: dict[str, list[Named]] = {}
    parameters: dict[str, list[Named]] = {}
    for component in every_component(skills):
        for each in component.configurations:
            configurations.setdefault(component.name, []).append((each.name, each.place))
            parameters.setdefault(component.name, []).extend((one.name, one.place) for one in each.parameters or ())
    for component_name, named in configurations.items():
        yield f"configuration of {component_name}", named
    for component_name, named in parameters.items():
        yield f"parameter of {component_name}", named


def _check_unique(kind: str, named: list[Named], findings: Findings) -> None:
    first: dict[str, Place] = {}
    for name, place in named:
        if name in first:
            findings.error(
                place, Code.DECLARED_TWICE, f"the {kind} {name!r} is there twice, first in {first[name]}: leave one out"
            )
        first.setdefault(name, place)


def _check_case(kind: str, named: Iterable[Named], findings: Findings) -> None:
    spelling: dict[str, str] = {}
    seen: set[str] = set()
    for name, place in named:
        if name in seen:
            continue
        seen.add(name)
        first = spelling.setdefault(name.lower(), name)
        if first != name:
            findings.warning(
                place, Code.CASE_DIFFERS, f"the {kind} {name!r} differs from {first!r} in case only: is it the same?"
            )


def _check_shared(skills: SkillSet, findings: Findings) -> None:
    """Note skills named like components: both name a part in files of modes."""
    components = {each.name: each.place for each in every_component(skills)}
    for skill in skills.skills:
        if skill.name in components:
            findings.error(
                skill.place,
                Code.SAME_NAME,
                f"{skill.name!r} is also a component, in {components[skill.name]}: a part of a system has one name",
            )


def _of(names: Iterable[Name]) -> list[Named]:
    return [(each.text, each.place) for each in names]
