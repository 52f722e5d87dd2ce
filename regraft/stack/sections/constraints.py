"""Reads the constraints of a stack file."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import ComponentSpec, Constraint, ConstraintKind
from regraft.bus_schema.model.constraints import constraint_expression, split_parameter
from regraft.bus_schema.model.expression_kinds import kind_of_parameter, kind_problems
from regraft.bus_schema.model.expressions import Expression
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.yaml.nodes import Node
from regraft.stack.yaml.section import Section

KINDS = {kind.value: kind for kind in ConstraintKind}
NOTHING = Constraint(ConstraintKind.PROVIDED)
"""Asks for nothing: replaces one that cannot be read, so that the others keep their places in the list."""


def read_constraints(root: Section, components: Mapping[str, ComponentSpec]) -> tuple[Constraint, ...]:
    """Return the constraints of the list ``constraints``; they speak of ``components``."""
    node = root.node("constraints")
    if node is None:
        return ()
    if not isinstance(node.value, tuple):
        root.wrong("constraints", f"must be a list, is {node.kind}")
        return ()
    items = Section(Node(dict(_numbered(node.value)), node.location), root.at("constraints"), root.report)
    return tuple(_constraint(items.section(item), components) or NOTHING for item in items.names())


def _numbered(parts: tuple[Node, ...]) -> list[tuple[str, Node]]:
    return [(str(index), part) for index, part in enumerate(parts)]


def _constraint(section: Section, components: Mapping[str, ComponentSpec]) -> Constraint | None:
    given = [key for key in section.names() if key in KINDS]
    if len(given) != 1:
        problem = "several" if given else "none"
        names = ", ".join(KINDS)
        section.report.add(section.path, f"must have exactly one of: {names}; has {problem}")
        return None
    kind = KINDS[given[0]]
    because = section.text("because")
    if kind is ConstraintKind.PARAMETER:
        return _parameter(section, because, components)
    if kind is ConstraintKind.REQUIRE:
        return _expression(section, because, components)
    if kind is ConstraintKind.PROVIDED:
        section.only(given[0], "because")
        services = section.distinct(given[0])
        if not services:
            section.wrong(given[0], "must list services")
        return Constraint(kind, services=services, because=because)
    section.only(given[0], "because")
    names_given = section.distinct(given[0])
    if not names_given:
        section.wrong(given[0], "must list components")
        return None
    for index, name in enumerate(names_given):
        _check_component(section, f"{given[0]}.{index}", name, components)
    return Constraint(kind, components=names_given, because=because)


def _expression(section: Section, because: str, components: Mapping[str, ComponentSpec]) -> Constraint | None:
    section.only("require", "because")
    expression = section.expression("require")
    if not expression:
        return None
    try:
        required = constraint_expression(expression)
    except BadMessage as error:
        section.wrong("require", str(error))
        return None
    for name in required.names:
        _check_component(section, "require", split_parameter(name)[0], components)
    problems = kind_problems(required, _kinds(required, components), ValueKind.TRUTH)
    for problem in problems:
        section.wrong("require", problem)
    return None if problems else Constraint(ConstraintKind.REQUIRE, expression=expression, because=because)


def _kinds(expression: Expression, components: Mapping[str, ComponentSpec]) -> dict[str, ValueKind]:
    """Return the kinds of parameters by the names that an expression has for them, and of whether one is active."""
    found = {}
    for name in expression.names:
        component, what = split_parameter(name)
        spec = components.get(component)
        described = spec.description.parameter(what) if spec and spec.description else None
        kind = kind_of_parameter(described) if described else ValueKind.TRUTH if what == "active" else None
        if kind is not None:
            found[name] = kind
    return found


def _parameter(section: Section, because: str, components: Collection[str]) -> Constraint | None:
    section.only("parameter", "at_least", "at_most", "because")
    path = section.text("parameter")
    minimum, maximum = section.number("at_least"), section.number("at_most")
    if "at_least" not in section and "at_most" not in section:
        section.report.add(section.path, "must say 'at_least', 'at_most' or both")
    if minimum is not None and maximum is not None and minimum > maximum:
        section.wrong("at_most", f"{maximum:g}: must not be less than 'at_least' {minimum:g}")
    component, parameter = split_parameter(path)
    if not path:
        return None
    if not component or not parameter:
        section.wrong("parameter", f"{path!r} must look like 'component.parameter'")
        return None
    _check_component(section, "parameter", component, components)
    return Constraint(ConstraintKind.PARAMETER, parameter=path, minimum=minimum, maximum=maximum, because=because)


def _check_component(section: Section, key: str, name: str, components: Collection[str]) -> None:
    if name not in components:
        section.wrong(key, f"there is no component {name!r}; {instead_of(name, components)}")
