"""Reads which qualities are measured, and how, from the file that is generated of skills."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.expression_kinds import kind_problems
from regraft.bus_schema.model.expressions import Expression
from regraft.services.observers.ros_files import read_parameter
from regraft.stack.yaml.nodes import Location

QUALITIES: Final = "qualities"
MAX_QUALITIES: Final = 200


def read_observed_qualities(file: Path) -> dict[str, tuple[Expression, Location]]:
    """Return the expression of each measured quality, and its place; raises StackError with all that is wrong."""
    node, path, report = read_parameter(file, QUALITIES)
    found: dict[str, tuple[Expression, Location]] = {}
    if not isinstance(node.value, dict):
        report.add(path, f"must be a map of qualities, is {node.kind}")
        report.raise_if_any()
        return found
    if len(node.value) > MAX_QUALITIES:
        report.add(path, f"has {len(node.value)} qualities, must have at most {MAX_QUALITIES}")
        report.raise_if_any()
    for name, part in node.value.items():
        if not isinstance(part.value, str):
            report.add(f"{path}.{name}", f"must be an expression in quotes, is {part.kind}")
            continue
        expression, problems = checked_expression(part.value, ValueKind.NUMBER)
        for problem in problems:
            report.add(f"{path}.{name}", problem)
        if expression is not None:
            found[name] = (expression, part.location)
    report.raise_if_any()
    return found


def checked_expression(text: str, wanted: ValueKind, *, constant: bool = False) -> tuple[Expression | None, list[str]]:
    """Return an expression whose value is of a kind, and what is wrong with it; a ``constant`` has no names."""
    try:
        expression = Expression(text)
    except BadMessage as error:
        return None, [str(error)]
    if not expression.names and not constant:
        return None, [f"{text!r} speaks of nothing that is measured: must be such as 'navigator.clearance'"]
    return expression, kind_problems(expression, wanted=wanted)
