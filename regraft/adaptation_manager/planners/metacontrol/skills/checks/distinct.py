"""Modes that inference cannot distinguish: it sees states and parameters alone."""

from __future__ import annotations

from collections.abc import Hashable

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Findings
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import (
    INACTIVE,
    Configurations,
    configurations_of,
    every_component,
    is_realisable,
    mode_name,
)
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Component, Place, Realization, SkillSet
from regraft.bus_schema.suggestions import near


def check(skills: SkillSet, findings: Findings) -> None:
    """Note configurations of a component, and realizations of a skill, that look the same at run time."""
    configurations = configurations_of(skills)
    places: dict[tuple[str, str], Place] = {}
    for component in every_component(skills):
        for each in component.configurations:
            if each.is_active:
                places.setdefault((component.name, mode_name(each)), each.place)
    seen = _Seen(configurations)
    alike: dict[tuple[str, Hashable], str] = {}
    for (name, mode), place in places.items():
        first = alike.setdefault((name, seen.parameters(name, mode)), mode)
        if first != mode:
            problem = f"inference cannot distinguish {mode!r} of {name!r} from {first!r}: their parameters are equal"
            own = configurations.modes[name]
            meant = near(mode, own.keys() - {mode}) if not own[mode] else None
            if meant is not None:
                problem += f"; {mode!r} has none of its own: did you mean {meant!r}?"
            findings.warning(place, Code.INDISTINGUISHABLE, problem)
    by_skill: dict[str, list[Realization]] = {}
    for realization in skills.realizations:
        if is_realisable(realization):
            by_skill.setdefault(realization.skill, []).append(realization)
    for realizations in by_skill.values():
        _check_realizations(realizations, seen, findings)


class _Seen:
    """The components as inference sees them, each computed once."""

    def __init__(self, configurations: Configurations) -> None:
        self._configurations = configurations
        self._known: dict[tuple[str, str], Hashable] = {}

    def parameters(self, component: str, mode: str) -> Hashable:
        key = (component, mode)
        if key not in self._known:
            values = self._configurations.differences(component, mode)
            self._known[key] = frozenset((name, type(value), value) for name, value in values.items())
        return self._known[key]

    def component(self, component: Component) -> Hashable:
        target = component.target
        return self.parameters(component.name, mode_name(target)) if target.is_active else target.state

    def realization(self, realization: Realization) -> Hashable:
        """Return what is not inactive: components that are left out are."""
        seen = {each.name: self.component(each) for each in realization.components}
        return frozenset((name, state) for name, state in seen.items() if state != INACTIVE)


def _check_realizations(realizations: list[Realization], seen: _Seen, findings: Findings) -> None:
    alike: dict[Hashable, Realization] = {}
    for each in realizations:
        first = alike.setdefault(seen.realization(each), each)
        if first is not each:
            problem = f"inference cannot distinguish {each.name!r} from {first.name!r} in {first.place}"
            findings.warning(each.place, Code.INDISTINGUISHABLE, f"{problem}: states and parameters are equal")
