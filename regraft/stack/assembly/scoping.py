"""Gives the names in a robot's file the robot's scope."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import ConstraintKind
from regraft.bus_schema.model.expressions import Expression
from regraft.bus_schema.model.modes.mode_conditions import OF_PARTS, REQUIREMENTS
from regraft.bus_schema.model.modes.mode_parts import SYSTEM, part_of
from regraft.bus_schema.model.robots.scopes import SHARED, component_in_scope, in_scope
from regraft.stack.sections.system_mode_rules import PartNames
from regraft.stack.yaml.document import read_document
from regraft.stack.yaml.nodes import Node, plain
from regraft.stack.yaml.problems import StackError

Rename = Callable[[str], str]
MODE_FIELDS = tuple(kind.value for kind in OF_PARTS)
"""The fields of a part, in conditions, whose values are names of modes."""


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a section of a robot's file: its name there, and its ``name`` and ``node`` in the stack."""

    section: str
    written: str
    name: str
    node: Node


def scoped_entries(scope: str, fields: Mapping[str, Node]) -> Iterator[Entry]:
    """Yield the topics, components, modes and rules of a robot with all names in a scope, empty for none."""
    scoping = _scoping(scope, fields)
    for key, topic in _map(fields.get("topics")).items():
        yield Entry("topics", key, in_scope(scope, key), topic)
    for key, component in _map(fields.get("components")).items():
        yield Entry("components", key, component_in_scope(scope, key), scoping.component(component))
    of_file = _file_of_modes(fields.get("modes"))
    if of_file is not None:
        yield Entry("modes", "", f"{scope}{SHARED}", of_file)
    for key, mode in _map(fields.get("modes")).items():
        if mode is not of_file:
            yield Entry("modes", key, in_scope(scope, key), _items(mode, scoping.change))
    for key, rule in _map(fields.get("rules")).items():
        yield Entry("rules", key, in_scope(scope, key), scoping.rule(rule))


def scoped_constraints(scope: str, fields: Mapping[str, Node]) -> tuple[Node, ...]:
    """Return the constraints of a robot with all names in a scope, which is empty for none."""
    node = fields.get("constraints")
    if node is None or not isinstance(node.value, tuple):
        return ()
    return tuple(map(_scoping(scope, fields).constraint, node.value))


def names_own_in_expressions(fields: Mapping[str, Node]) -> bool:
    """Return whether an expression of a robot's file names what is the robot's own."""
    return _expressions("robot", fields) != _expressions("", fields)


def _expressions(scope: str, fields: Mapping[str, Node]) -> list[PlainValue]:
    """Return the texts of all expressions of a robot in a scope."""
    constraints = ((ConstraintKind.REQUIRE.value, node) for node in scoped_constraints(scope, fields))
    rules = (("when", _scoping(scope, fields).rule(rule)) for rule in _map(fields.get("rules")).values())
    return [plain(part) for key, node in (*constraints, *rules) if (part := _map(node).get(key)) is not None]


def _scoping(scope: str, fields: Mapping[str, Node]) -> _Scoping:
    component = partial(component_in_scope, scope)
    own = set(_map(fields.get("components")))
    parts = _parts(fields.get("modes"))

    def reference(path: str) -> str:
        return component(path) if path.partition(".")[0] in own else path

    def condition(path: str) -> str:
        owner, _, field = path.rpartition(".")
        if field in MODE_FIELDS and owner in (SYSTEM, *parts):
            return component(path)
        if path.startswith(f"{REQUIREMENTS}.") and REQUIREMENTS not in own:
            return f"{REQUIREMENTS}.{component(path.removeprefix(f'{REQUIREMENTS}.'))}"
        return reference(path)

    return _Scoping(component, partial(in_scope, scope), reference, condition)


def _file_of_modes(modes: Node | None) -> Node | None:
    """Return the file that a robot's modes are from: all of them, or all but its own."""
    return modes if modes is None or isinstance(modes.value, str) else _map(modes).get(SHARED)


def _parts(modes: Node | None) -> set[str]:
    """Return the parts that a robot's modes are of, by their short names."""
    of_file = _file_of_modes(modes)
    own = {part_of(name) for name, mode in _map(modes).items() if mode is not of_file}
    if of_file is None or not isinstance(of_file.value, str):
        return own
    try:
        document, _ = read_document(of_file.location.folder / of_file.value)
    except StackError:  # reported where the modes are read
        return own
    return own | {PartNames("").component(name) for name in _map(document)}


class _Scoping:
    def __init__(self, component: Rename, name: Rename, reference: Rename, condition: Rename) -> None:
        self._component = component
        self._name = name
        self._reference = reference
        self._condition = condition

    def component(self, node: Node) -> Node:
        ways = {"connect": self._names, "services": self._names}
        return _fields(node, ways)

    def constraint(self, node: Node) -> Node:
        """Return a constraint; the robot's own components are those that an expression names without its scope."""
        components = partial(_items, way=partial(_text, rename=self._component))
        return _fields(
            node,
            {
                ConstraintKind.AT_LEAST_ONE_ACTIVE.value: components,
                ConstraintKind.AT_MOST_ONE_ACTIVE.value: components,
                ConstraintKind.PARAMETER.value: partial(_text, rename=self._component),
                ConstraintKind.REQUIRE.value: partial(_text, rename=self._expression),
                ConstraintKind.PROVIDED.value: partial(_items, way=partial(_text, rename=self._name)),
            },
        )

    def change(self, node: Node) -> Node:
        """Return a change of a mode."""
        return _fields(
            node,
            {
                "component": partial(_text, rename=self._component),
                "topic": partial(_text, rename=self._name),
                "topics": partial(_items, way=self._topic),
                "connect": self._names,
                "services": self._names,
                "spec": self.component,
                "mode": partial(_text, rename=self._name),
            },
        )

    def rule(self, node: Node) -> Node:
        """Return a rule; its condition names the robot's own components, modes and requirements without its scope."""
        modes = partial(_text, rename=self._name)
        ways = {
            "mode": modes,
            "from": partial(_one_or_items, way=modes),
            "when": partial(_text, rename=self._when),
        }
        return _fields(node, ways)

    def _names(self, node: Node) -> Node:
        return _values(node, partial(_text, rename=self._name))

    def _topic(self, node: Node) -> Node:
        """Return a topic that a change adds or removes: a map, or its name."""
        return _fields(_text(node, self._name), {"name": partial(_text, rename=self._name)})

    def _when(self, condition: str) -> str:
        def mode(name: str, compared: str) -> str:
            return self._name(compared) if compared and name.rpartition(".")[2] in MODE_FIELDS else compared

        try:
            return Expression(condition).renamed(self._condition, mode)
        except BadMessage:  # reported where the rules are read
            return condition

    def _expression(self, expression: str) -> str:
        try:
            return Expression(expression).renamed(self._reference)
        except BadMessage:  # the section of the constraints reports it
            return expression


def _map(node: Node | None) -> dict[str, Node]:
    return node.value if node is not None and isinstance(node.value, dict) else {}


def _text(node: Node, rename: Rename) -> Node:
    return Node(rename(node.value), node.location) if isinstance(node.value, str) and node.value else node


def _items(node: Node, way: Callable[[Node], Node]) -> Node:
    return Node(tuple(map(way, node.value)), node.location) if isinstance(node.value, tuple) else node


def _one_or_items(node: Node, way: Callable[[Node], Node]) -> Node:
    return _items(node, way) if isinstance(node.value, tuple) else way(node)


def _values(node: Node, way: Callable[[Node], Node]) -> Node:
    if not isinstance(node.value, dict):
        return node
    return Node({key: way(part) for key, part in node.value.items()}, node.location)


def _fields(node: Node, ways: Mapping[str, Callable[[Node], Node]]) -> Node:
    if not isinstance(node.value, dict):
        return node
    parts = {key: ways[key](part) if key in ways else part for key, part in node.value.items()}
    return Node(parts, node.location)
