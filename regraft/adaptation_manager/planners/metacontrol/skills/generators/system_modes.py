"""Modes for ROS 2's system_modes: a system for each skill, a mode for each realization (paper, section II-B)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.skills.generators.naming import Names, qualified
from regraft.adaptation_manager.planners.metacontrol.skills.generators.yaml_text import names_below, scalar, word
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import (
    INACTIVE,
    REACHABLE,
    Configurations,
    Values,
    choosable,
    components_of,
    configurations_of,
    is_rest,
    mode_name,
)
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import ACTIVE, Component, Realization, SkillSet
from regraft.bus_schema.model.modes.mode_parts import DEFAULT


@dataclass(frozen=True, slots=True)
class System:
    """A system of the file: the state of each part in each mode, the default first."""

    name: str
    modes: Mapping[str, Mapping[str, str]]


def system_modes(skills: SkillSet, one_system: str = "") -> str:
    """Return the text of a modes file. ``one_system`` names the only system, as in the published files."""
    configurations = configurations_of(skills)
    modes = {name: _mode_names(configurations.modes[name]) for name in configurations.modes}
    systems = tuple(systems_of(skills, modes, one_system))
    used = dict.fromkeys(name for system in systems for name in system.modes[DEFAULT])
    lines = [f"# Made from {Path(skills.file).name} by 'regraft skills generate': change that file, not this one."]
    for system in systems:
        lines += _system_lines(system)
    for component in used:
        lines += _node_lines(component, modes.get(component, {}), configurations)
    return "\n".join([*lines, ""])


def systems_of(skills: SkillSet, modes: Mapping[str, Mapping[str, str]], one_system: str) -> Iterator[System]:
    """Yield the systems; ``modes`` are the names of components' modes in the file."""
    choices = choosable(skills)
    rests = [each for each in skills.realizations if is_rest(each)]
    if one_system:
        names = qualified(choices, Names([DEFAULT]))
        yield System(one_system, _modes(choices, rests, names, modes))
        return
    choices_of: dict[str, list[Realization]] = {}
    rests_of: dict[str, list[Realization]] = {}
    for found, every in ((choices_of, choices), (rests_of, rests)):
        for each in every:
            found.setdefault(each.skill, []).append(each)
    for skill in skills.skills:
        own, rest = choices_of.get(skill.name, []), rests_of.get(skill.name, [])
        if own or rest:
            yield System(skill.name, _modes(own, rest, {each: each.name for each in own}, modes))


def _modes(
    choices: list[Realization] | tuple[Realization, ...],
    rests: list[Realization],
    names: Mapping[Realization, str],
    modes: Mapping[str, Mapping[str, str]],
) -> dict[str, dict[str, str]]:
    """Return the state of each part in each mode. The default is rest; parts that rest leaves out are inactive."""
    default = dict.fromkeys(components_of([*rests, *choices]), INACTIVE)
    for rest in reversed(rests):
        states = {each.name: _state(each, modes) for each in rest.components}
        default |= {name: state for name, state in states.items() if state.partition(".")[0] in REACHABLE}
    found = {DEFAULT: default}
    for each in choices:
        found[names[each]] = {component.name: _state(component, modes) for component in each.components}
    return found


def _state(component: Component, modes: Mapping[str, Mapping[str, str]]) -> str:
    target = component.target
    if not target.is_active:
        return target.state
    mode = mode_name(target)
    return ACTIVE if mode == DEFAULT else f"{ACTIVE}.{modes[component.name][mode]}"


def _mode_names(modes: Mapping[str, Values]) -> dict[str, str]:
    """Return the names of a component's modes in the file, where they have no dot; the default comes first."""
    names = Names([DEFAULT])
    given = {mode: names.take(mode.replace(".", "_")) for mode in modes if mode != DEFAULT}
    return {DEFAULT: DEFAULT} | given


def _system_lines(system: System) -> Iterator[str]:
    yield f"{word(system.name)}:"
    yield "  ros__parameters:"
    yield "    type: system"
    yield from names_below("parts", map(_node, system.modes[DEFAULT]), "    ")
    yield "    modes:"
    for mode, states in system.modes.items():
        yield f"      {word(mode)}:"
        for name, state in states.items():
            yield f"        {word(_node(name))}: {state}"


def _node_lines(component: str, modes: Mapping[str, str], configurations: Configurations) -> Iterator[str]:
    """Yield the modes of a component. One that is only active or not has none."""
    defaults = configurations.defaults.get(component, {})
    if not defaults and len(modes) < 2:
        return
    yield f"{word(_node(component))}:"
    yield "  ros__parameters:"
    yield "    type: node"
    yield "    modes:"
    for mode, name in modes.items():
        yield f"      {word(name)}:"
        values = defaults if mode == DEFAULT else configurations.modes[component][mode]
        yield f"        ros__parameters:{'' if values else ' {}'}"
        for parameter, value in values.items():
            yield f"          {word(parameter)}: {scalar(value)}"


def _node(component: str) -> str:
    """Return the name of a component's node: system_modes has namespaces with slashes, and dots before modes."""
    return component.replace(".", "/")
