"""The meaning of settings in an architecture: whether they are in force, and which changes they need."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from regraft.adaptation_manager.planners.choices.settings import Kind, Setting, identity
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.model.adaptation import Add, Change, ChangeState, Connect, Move, Remove, SetParameters, Swap
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State, Transition, route
from regraft.bus_schema.model.parameter_values import effective_parameter

LEADS_TO: Final = {
    "configure": State.INACTIVE,
    "activate": State.ACTIVE,
    "deactivate": State.INACTIVE,
    "cleanup": State.UNCONFIGURED,
}
"""The state that a transition leads to as an option; one that takes several transitions gets them."""


def stands(setting: Setting, architecture: Architecture) -> bool:
    """Return whether a setting is in force in an architecture."""
    spec = architecture.components.get(setting.component)
    if setting.kind is Kind.PRESENCE:
        return (spec is not None) == bool(setting.value)
    if spec is None:
        return False
    match setting.kind:
        case Kind.PORT:
            return spec.connections.get(setting.member) == str(setting.value)
        case Kind.CLASS:
            return spec.cls == str(setting.value)
        case Kind.HOST:
            return spec.host == str(setting.value)
        case Kind.TRANSITION | Kind.STATE:
            return spec.state is goal_of(setting)
    if spec.description is None:
        return False
    return identity(effective_parameter(spec.description, spec.parameters, setting.member)) == identity(setting.value)


def not_in_force(settings: Iterable[Setting], architecture: Architecture) -> list[Setting]:
    """Return the settings that are not in force, those of a component that is to be absent aside."""
    every = list(settings)
    absent = {each.component for each in every if each.kind is Kind.PRESENCE and not each.value}
    counted = [each for each in every if each.kind is Kind.PRESENCE or each.component not in absent]
    return [each for each in counted if not stands(each, architecture)]


def all_stand(settings: Iterable[Setting], architecture: Architecture) -> bool:
    """Return whether all settings are in force in an architecture, those of a component that is to be absent aside."""
    return not not_in_force(settings, architecture)


def goal_of(setting: Setting) -> State:
    """Return the state that a setting of state or transition leads to."""
    return LEADS_TO[setting.value] if setting.kind is Kind.TRANSITION else State(setting.value)


def spec_of(setting: Setting) -> ComponentSpec:
    """Return the component that a setting of presence adds; raises BadMessage."""
    plain = {"name": setting.component} | (setting.value if isinstance(setting.value, dict) else {})
    spec: ComponentSpec = record_shape(ComponentSpec).unpack(plain)
    return spec


@dataclass(slots=True)
class _Part:
    """All that is to be changed of one component."""

    parameters: dict[str, PlainValue] = field(default_factory=dict)
    connections: dict[str, str | None] = field(default_factory=dict)
    added: Setting | None = None
    removed: bool = False
    cls: str = ""
    host: str = ""
    state: Setting | None = None


def changes_for(settings: Sequence[Setting], architecture: Architecture) -> tuple[Change, ...]:
    """Return what must be changed in an architecture so that settings are in force; nothing if they are.

    Added, exchanged and moved components come first, removed ones last. A component that is exchanged or added gets
    its parameters and connections with that. One that is exchanged gets all of its parameters that settings give.
    """
    parts = _parts(settings, architecture)
    first: list[Change] = []
    for component, part in parts.items():
        if part.added is not None:
            first.append(Add(component, _added(part)))
        elif part.cls and not part.removed:
            first.append(Swap(component, part.cls, part.parameters, part.connections))
        if part.host and not part.removed and part.added is None:
            first.append(Move(component, part.host))
    kept = {name: part for name, part in parts.items() if not part.removed and part.added is None}
    given = {name: part for name, part in kept.items() if not part.cls}
    parameters = (SetParameters(name, part.parameters) for name, part in given.items() if part.parameters)
    last = (Remove(name) for name, part in parts.items() if part.removed)
    return (*first, *parameters, *_others(settings, kept, architecture), *last)


def _parts(settings: Sequence[Setting], architecture: Architecture) -> dict[str, _Part]:
    parts: dict[str, _Part] = {}
    swapped = {each.component for each in settings if each.kind is Kind.CLASS and not stands(each, architecture)}
    for setting in settings:
        # A value that stands may be the former class's default: the next class may have another one.
        is_lost = setting.kind is Kind.PARAMETER and setting.component in swapped
        if stands(setting, architecture) and not is_lost:
            continue
        part = parts.setdefault(setting.component, _Part())
        match setting.kind:
            case Kind.PARAMETER:
                part.parameters[setting.member] = setting.value
            case Kind.PORT:
                part.connections[setting.member] = str(setting.value)
            case Kind.CLASS:
                part.cls = str(setting.value)
            case Kind.HOST:
                part.host = str(setting.value)
            case Kind.PRESENCE if setting.value:
                part.added = setting
            case Kind.PRESENCE:
                part.removed = True
            case Kind.STATE | Kind.TRANSITION:
                part.state = setting
    for component in [name for name in parts if _is_absent(name, settings) and name not in architecture.components]:
        del parts[component]
    return parts


def _is_absent(component: str, settings: Sequence[Setting]) -> bool:
    return any(each.component == component and each.kind is Kind.PRESENCE and not each.value for each in settings)


def _added(part: _Part) -> ComponentSpec:
    assert part.added is not None
    spec = spec_of(part.added)
    return replace(
        spec,
        cls=part.cls or spec.cls,
        host=part.host or spec.host,
        parameters=spec.parameters | part.parameters,
        connections=spec.connections | part.connections,
        state=goal_of(part.state) if part.state else spec.state,
    )


def _others(settings: Sequence[Setting], kept: dict[str, _Part], architecture: Architecture) -> list[Change]:
    """Return connections and transitions, in the order in which they are set."""
    found: list[Change] = []
    for setting in settings:
        part = kept.get(setting.component)
        if part is None or stands(setting, architecture):
            continue
        if setting.kind is Kind.PORT and not part.cls:
            found.append(Connect(setting.component, setting.member, str(setting.value)))
        elif setting.kind in (Kind.TRANSITION, Kind.STATE):
            goal = goal_of(setting)
            spec = architecture.components.get(setting.component)  # another client may have removed it meanwhile
            way = (route(spec.state, goal) if spec is not None else ()) or _by_name(setting)
            found += [ChangeState(setting.component, transition) for transition in way]
    return found


def _by_name(setting: Setting) -> tuple[Transition, ...]:
    """Return the transition to ask for where no way leads to it: the adaptation's check then reports why."""
    if setting.kind is Kind.TRANSITION:
        return (Transition(setting.value),)
    return (Transition.CLEANUP,) if goal_of(setting) is State.UNCONFIGURED else (Transition.ACTIVATE,)
