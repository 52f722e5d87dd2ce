"""Designs as modes of the stack: which mode each is, what it claims, and when two exclude each other."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Model
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planning.modes import NoSuchMode, changes_of
from regraft.bus_schema.model.adaptation import Add, Change, ChangeState, Connect, SetParameters
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import Transition
from regraft.bus_schema.model.modes.mode_parts import DEFAULT, part_of
from regraft.bus_schema.suggestions import instead_of

ACTIVATE: Final = Transition.ACTIVATE


@dataclass(frozen=True, slots=True)
class DesignMode:
    """A design's mode: its name, the part that it is of, the part's rest, and its changes; the design's function.

    ``claims`` has the settings of each component that is active in it, as text. Other components are only released.
    ``problem`` is why there is no such mode.
    """

    design: str
    mode: str = ""
    part: str = ""
    rest: str = ""
    changes: tuple[Change, ...] = ()
    claims: Mapping[str, str] = field(default_factory=dict)
    problem: str = ""
    function: str = ""


class Designs:
    """The designs of a model in a stack. ``scope`` is the robot whose they are, empty for the system's."""

    def __init__(self, model: Model, architecture: Architecture, scope: str) -> None:
        self._modes = architecture.modes
        chosen = (name for name, design in model.designs.items() if not design.is_rest)
        functions = {local_name(each.function) for each in model.designs.values()}
        self._by_design = {name: _mode_of(name, model, architecture, scope, functions) for name in chosen}
        self._by_mode = {each.mode: each for each in self._by_design.values() if each.mode}
        self._without_mode = {name: each.problem for name, each in self._by_design.items() if each.problem}
        self._claimed_by: dict[str, list[str]] = {}
        for name, each in self._by_design.items():
            for component in each.claims:
                self._claimed_by.setdefault(component, []).append(name)
        changes = [change for each in self._by_design.values() for change in each.changes]
        added = {each.component for each in changes if isinstance(each, Add)}
        self._needed = {each.component for each in changes} - added

    def fits(self, architecture: Architecture) -> bool:
        """Return whether an architecture has the modes that are known here."""
        return architecture.modes == self._modes

    def of(self, design: str) -> DesignMode:
        """Return a design's mode."""
        return self._by_design[design]

    def of_mode(self, mode: str) -> DesignMode | None:
        """Return the design that a mode is, None for rest and modes of others."""
        return self._by_mode.get(mode)

    def missing(self) -> tuple[str, ...]:
        """Return why designs have no mode."""
        return tuple(self._without_mode.values())

    def removed(self, architecture: Architecture) -> frozenset[str]:
        """Return the components that designs change, and that the stack does not have any more."""
        return frozenset(self._needed - architecture.components.keys())

    def unavailable(self, architecture: Architecture) -> dict[str, str]:
        """Return the designs that cannot be entered in the stack as it is, and why: no mode, or no component."""
        found = dict(self._without_mode)
        for component in sorted(self.removed(architecture)):
            why = f"the component {component!r} was removed from the stack"
            found |= {name: why for name in self._claimed_by.get(component, ()) if name not in found}
        return found

    def clash(self, one: str, other: str) -> str:
        """Return why two designs exclude each other, empty if they do not."""
        mine, others = self._by_design[one], self._by_design[other]
        if mine.part == others.part and mine.mode != others.mode:
            return f"its mode {mine.mode!r} excludes {others.mode!r}"
        for component in mine.claims.keys() & others.claims.keys():
            if mine.claims[component] != others.claims[component]:
                return f"it needs {component} with {mine.claims[component]}, and {local_name(other)} needs another"
        return ""


def _mode_of(
    design: str, model: Model, architecture: Architecture, scope: str, functions: Collection[str]
) -> DesignMode:
    own, function = local_name(design), local_name(model.designs[design].function)
    prefix = f"{scope.replace('.', '/')}/" if scope else ""
    mode = _found(own, function, prefix, architecture, functions)
    if not mode:
        wanted = f"{prefix}{function}.{own}"
        why = f"{own}: there is no mode {wanted!r}; {instead_of(wanted, architecture.modes)}"
        return DesignMode(design, problem=why)
    try:
        changes = changes_of(mode, architecture)
    except NoSuchMode as error:
        return DesignMode(design, problem=f"{own}: {error}")
    rest = f"{mode.rpartition('.')[0]}.{DEFAULT}"
    known = rest if rest in architecture.modes else ""
    claims, solved = claims_of(changes), model.designs[design].function
    return DesignMode(design, mode, part_of(mode), known, changes, claims, function=solved)


def _found(own: str, function: str, prefix: str, architecture: Architecture, functions: Collection[str]) -> str:
    """Return the mode that a design is: one of its function's system, else the only one of that name in any system.

    A design that shares its name with something else has the function before it, and its mode has not. That name is
    not looked for in the systems of other ``functions``, which may have it, too.
    """
    short = own.removeprefix(f"{function}_")
    for name in (own, short):
        if f"{prefix}{function}.{name}" in architecture.modes:
            return f"{prefix}{function}.{name}"
    modes = [each.rpartition(".") for each in architecture.modes if each.startswith(prefix)]
    others = [f"{system}.{name}" for system, _, name in modes if name == own] or [
        f"{system}.{name}"
        for system, _, name in modes
        if name == short and system.removeprefix(prefix) not in functions
    ]
    return others[0] if len(others) == 1 else ""


def claims_of(changes: tuple[Change, ...]) -> dict[str, str]:
    """Return the settings of each component that changes activate, as text."""
    active = [each.component for each in changes if isinstance(each, ChangeState) and each.transition is ACTIVATE]
    found: dict[str, list[str]] = {component: [] for component in active}
    for each in changes:
        if each.component in found and isinstance(each, SetParameters):
            found[each.component] += [f"{name} = {value!r}" for name, value in sorted(each.parameters.items())]
        elif each.component in found and isinstance(each, Connect):
            found[each.component].append(f"{each.port} on {each.topic!r}")
    return {component: ", ".join(settings) or "no settings of its own" for component, settings in found.items()}
