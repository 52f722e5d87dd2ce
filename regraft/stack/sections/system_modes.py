"""Reads the modes files of ROS 2's system_modes (micro-ROS/system_modes) as they are.

A *node* is a component; its modes are sets of parameters. A *system* has parts, nodes or other systems; its modes have
the state and mode of each part. Every mode becomes one of ours, named ``PART.MODE``. Parts that a mode leaves out come
from ``__DEFAULT__``. ``parts`` has nothing that the default mode has not, and is ignored. ``rules`` become rules of the
stack, for the planner that enforces them. In a robot's file all names are the robot's own.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.bus_schema.model.modes.mode_parts import DEFAULT, way_between
from regraft.bus_schema.model.modes.mode_sizes import size_problems
from regraft.bus_schema.model.robots.scopes import SHARED
from regraft.bus_schema.suggestions import Hints
from regraft.stack.sections.system_mode_rules import Part, PartNames, rules_of
from regraft.stack.yaml.document import read_document
from regraft.stack.yaml.nodes import Location, Node, plain
from regraft.stack.yaml.problems import Report

PARAMETERS = "ros__parameters"
Place = tuple[str, str]
"""A part, and a mode or state of it."""
TRANSITIONS = {"active": "activate", "inactive": "deactivate", "unconfigured": "cleanup"}


@dataclass(frozen=True, slots=True)
class GivenValue:
    """A parameter as a mode of a node gives it: its component, and its ``field`` and ``node`` in the file."""

    component: str
    parameter: str
    field: str
    node: Node


@dataclass(frozen=True, slots=True)
class NamedComponent:
    """A component as a file names it: its name, and its ``field`` and ``location`` in the file."""

    component: str
    field: str
    location: Location


@dataclass(frozen=True, slots=True)
class SystemModesFile:
    """The changes of each mode as plain data, the modes of other parts that it enters, rules and values.

    ``rule_locations`` are the places of rules, by name; ``named`` are all components, each where the file names it.
    """

    modes: dict[str, PlainValue]
    parts: dict[str, tuple[str, ...]]
    rules: tuple[ModeRule, ...]
    values: tuple[GivenValue, ...]
    rule_locations: dict[str, Location]
    named: tuple[NamedComponent, ...]


def read_system_modes(file: Path, components: Collection[str], scope: str = "") -> dict[str, PlainValue]:
    """Return the changes of each mode in a file, as plain data; its nodes are ``components``. Raises StackError."""
    return read_system_modes_file(file, components, scope).modes


def read_system_modes_file(file: Path, components: Collection[str], scope: str = "") -> SystemModesFile:
    """Return the content of a file; its nodes are ``components``. Raises StackError.

    ``scope`` is the robot that all of the file's names belong to: a node ``laser`` is its component ``rescuer.laser``.
    """
    document, report = read_document(file)
    names = PartNames(scope)
    reader = _Reader(report, components, names)
    assert isinstance(document.value, dict)
    for name, node in document.value.items():
        reader.read_part(name, node)
    reader.check()
    rules = [rule for part in reader.parts.values() for rule in rules_of(part, reader.parts, names, report)]
    report.raise_if_any()
    both = [(part, mode) for part in reader.parts.values() for mode in part.modes]
    entered = {names.mode(part.name, mode): tuple(reader.entered(part, mode)) for part, mode in both}
    return SystemModesFile(
        {names.mode(part.name, mode): list(reader.changes(part, mode)) for part, mode in both},
        {name: modes for name, modes in entered.items() if modes},
        tuple(rules),
        tuple(reader.values()),
        {
            names.mode(part.name, name): node.location
            for part in reader.parts.values()
            for name, node in part.rules.items()
        },
        tuple(reader.named()),
    )


class _Reader:
    def __init__(self, report: Report, components: Collection[str], names: PartNames) -> None:
        self.parts: dict[str, Part] = {}
        self._report = report
        self._components = components
        self._names = names

    def _wrong(self, location: Location, where: str, problem: str) -> None:
        self._report.add_at(location, where, problem)

    def _map(self, node: Node, where: str) -> dict[str, Node]:
        if isinstance(node.value, dict):
            return node.value
        self._wrong(node.location, where, f"must be a map, is {node.kind}")
        return {}

    def _parameters(self, node: Node, where: str) -> dict[str, Node]:
        found = self._map(node, where)
        if found and PARAMETERS not in found:
            hint = " (two underscores)" if "ros_parameters" in found else ""
            self._wrong(node.location, where, f"must have {PARAMETERS!r}{hint}")
        return self._map(found[PARAMETERS], f"{where}.{PARAMETERS}") if PARAMETERS in found else {}

    def read_part(self, name: str, node: Node) -> None:
        """Read one node or system."""
        body = self._parameters(node, name)
        kind = body.get("type")
        part = self.parts[name] = Part(name, node.location, kind is not None and kind.value == "node")
        modes = self._map(body["modes"], f"{name}.modes") if "modes" in body else {}
        if modes and next(iter(modes)) != DEFAULT:
            self._wrong(
                body["modes"].location, f"{name}.modes", f"must begin with {DEFAULT}, which others fall back on"
            )
        for mode, wanted in modes.items():
            where = f"{name}.modes.{mode}"
            if "." in mode:
                self._wrong(wanted.location, where, "a mode's name may not have a '.'")
            if mode.endswith(SHARED):
                self._wrong(wanted.location, where, f"a mode's name may not end with {SHARED!r}")
            settings = self._parameters(wanted, where) if part.is_node else self._map(wanted, where)
            part.modes[mode] = dict(_flat(settings)) if part.is_node else settings
        part.rules = self._map(body["rules"], f"{name}.rules") if "rules" in body else {}

    def check(self) -> None:
        """Note all that does not fit together."""
        components = Hints(self._components)
        parts = Hints([*self.parts, *self._names.own(self._components)])
        modes = {name: Hints(part.modes) for name, part in self.parts.items()}
        for part in self.parts.values():
            component = self._names.component(part.name)
            if part.is_node and component not in self._components:
                self._wrong(part.location, part.name, components.no_such("component", component))
            if not part.is_node and DEFAULT in part.modes and not part.modes[DEFAULT]:
                self._wrong(part.location, f"{part.name}.modes.{DEFAULT}", "names no part: must name at least one")
            for mode, settings in part.modes.items():
                for name, node in settings.items():
                    where = f"{part.name}.modes.{mode}.{name}"
                    if DEFAULT in part.modes and name not in part.modes[DEFAULT]:
                        self._wrong(node.location, where, f"{DEFAULT} does not name it, so no other mode can")
                    if not part.is_node:
                        self._check_state(name, node, where, parts, modes.get(name, Hints(())))
        inner = {part.name: self._inner_parts(part) for part in self.parts.values()}
        for part in self.parts.values():
            way = next(filter(None, (way_between(name, part.name, inner) for name in inner[part.name])), None)
            if way is not None:
                self._wrong(part.location, part.name, f"is a part of itself: {' > '.join((part.name, *way))}")
        told: set[str] = set()
        for (name, mode), problem in size_problems(*self._sizes()):
            if name not in told:
                self._wrong(self.parts[name].location, f"{name}.modes.{mode}", problem)
            told.add(name)

    def _check_state(self, name: str, node: Node, where: str, parts: Hints, modes: Hints) -> None:
        state, _, mode = str(node.value).partition(".")
        if state not in TRANSITIONS:
            self._wrong(
                node.location, where, f"{node.value!r}: must be one of: {', '.join(TRANSITIONS)}, or active.MODE"
            )
        known = self.parts.get(name)
        if known is None and self._names.component(name) not in self._components:
            self._wrong(node.location, where, parts.no_such("part", name))
        elif mode and (known is None or mode not in known.modes):
            self._wrong(node.location, where, f"{name} has no mode {mode!r}; {modes.instead_of(mode)}")

    def _inner_parts(self, part: Part) -> list[str]:
        """Return the parts of a system that the file has."""
        settings = () if part.is_node else part.modes.values()
        return sorted({name for each in settings for name in each if name in self.parts})

    def _sizes(self) -> tuple[dict[Place, int], dict[Place, list[Place]]]:
        """Return the most changes of its own that each mode, or state, of a system has, and what it enters."""
        own: dict[Place, int] = {}
        entered: dict[Place, list[Place]] = {}
        for part in self.parts.values():
            for mode in (*part.modes, *TRANSITIONS) if not part.is_node else ():
                place = part.name, mode
                own[place], entered[place] = 0, []
                for name, node in part.settings(mode if mode in part.modes else DEFAULT).items():
                    state, _, inner = str(node.value).partition(".")
                    if name not in self.parts or self.parts[name].is_node:
                        own[place] += 2
                    elif mode in part.modes and state == State.ACTIVE.value:
                        entered[place].append((name, inner or DEFAULT))
                    else:
                        entered[place].append((name, state if mode in part.modes else mode))
        return own, entered

    def changes(self, part: Part, mode: str) -> Iterator[PlainValue]:
        """Yield the changes that bring a part, active, into a mode."""
        if part.is_node:
            yield from self._enter(part.name, "active", mode)
            return
        for name, node in part.settings(mode).items():
            state, _, inner = str(node.value).partition(".")
            yield from self._enter(name, state, inner)

    def values(self) -> Iterator[GivenValue]:
        """Yield all parameters that modes give to nodes, each where it is written."""
        for part in self.parts.values():
            for mode, settings in part.modes.items() if part.is_node else ():
                for name, node in settings.items():
                    component = self._names.component(part.name)
                    yield GivenValue(component, name, f"{part.name}.modes.{mode}.{name}", node)

    def named(self) -> Iterator[NamedComponent]:
        """Yield the components that the file names, as a node or as a part of a system."""
        for part in self.parts.values():
            if part.is_node:
                yield NamedComponent(self._names.component(part.name), part.name, part.location)
            for mode, settings in part.modes.items() if not part.is_node else ():
                for name, node in settings.items():
                    if name not in self.parts:
                        field = f"{part.name}.modes.{mode}.{name}"
                        yield NamedComponent(self._names.component(name), field, node.location)

    def entered(self, part: Part, mode: str) -> Iterator[str]:
        """Yield the modes of other parts that a mode of a system enters."""
        for name, node in part.settings(mode).items() if not part.is_node else ():
            state, _, inner = str(node.value).partition(".")
            known = self.parts.get(name)
            if known is not None and state == "active" and (inner or DEFAULT) in known.modes:
                yield self._names.mode(name, inner or DEFAULT)

    def _enter(self, name: str, state: str, mode: str) -> Iterator[PlainValue]:
        part = self.parts.get(name)
        if part is not None and not part.is_node:
            if state == "active":
                yield from self.changes(part, mode or DEFAULT)
            else:
                for inner in part.settings(DEFAULT):
                    yield from self._enter(inner, state, "")
            return
        component = self._names.component(name)
        settings = part.settings(mode or DEFAULT) if part is not None and state == "active" else {}
        if settings:
            values = {parameter: plain(node) for parameter, node in settings.items()}
            yield {"change": "set_parameters", "component": component, "parameters": values}
        yield {"change": "transition", "component": component, "transition": TRANSITIONS[state]}


def _flat(settings: dict[str, Node], above: str = "") -> Iterator[tuple[str, Node]]:
    """Yield parameters by their dotted names, as ROS 2 has nested ones."""
    for name, node in settings.items():
        if isinstance(node.value, dict):
            yield from _flat(node.value, f"{above}{name}.")
        else:
            yield f"{above}{name}", node
