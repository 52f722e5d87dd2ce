"""Reads the kinds of fields that only decision files have."""

from __future__ import annotations

from collections.abc import Iterator

from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.expressions import Expression
from regraft.stack.yaml.nodes import Node
from regraft.stack.yaml.section import Section


def expression(section: Section, key: str) -> Expression | None:
    """Return an expression, which may be written as a number or truth value; None if there is none, or a wrong one."""
    node = section.node(key)
    if node is None:
        return None
    if isinstance(node.value, str | int | float):
        try:
            return Expression(str(node.value))
        except BadMessage as error:
            section.wrong(key, str(error))
            return None
    section.wrong(key, f"must be an expression, is {node.kind}")
    return None


def expressions(section: Section) -> Iterator[tuple[str, Expression]]:
    """Yield the expressions of a map by name."""
    for name in section.names():
        found = expression(section, name)
        if found is not None:
            yield name, found


def items(section: Section, key: str) -> Section:
    """Return a list as a map whose keys are numbers; a single map is a list of one."""
    node = section.node(key)
    if node is None:
        return Section(Node({}), section.at(key), section.report)
    if isinstance(node.value, dict):
        return Section(Node({"0": node}), section.at(key), section.report)
    if not isinstance(node.value, tuple):
        section.wrong(key, f"must be a list, is {node.kind}")
        return Section(Node({}), section.at(key), section.report)
    return Section(Node({str(i): part for i, part in enumerate(node.value)}), section.at(key), section.report)
