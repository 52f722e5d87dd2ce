"""Expressions over the parameters and states of components, for constraints: ``a.rate * 2 <= b.rate or not c.active``.

They are written as in Python, of a few parts only: numbers, texts, ``True`` and ``False``, ``component.parameter``,
``component.active``, ``+ - * /``, comparisons (also chained), ``and``, ``or``, ``not``, and brackets.
"""

from __future__ import annotations

import ast
import operator
import sys
from collections.abc import Callable
from typing import Any

LONGEST = 1000
OPERATORS: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}


class BadExpression(ValueError):
    """An expression that cannot be read, or not be computed with the values that there are; the text says why."""


def references(expression: str) -> tuple[str, ...]:
    """Return the dotted names that an expression speaks of, each once, in their order; raises BadExpression."""
    found: list[ast.expr] = []
    _walk(_parsed(expression), found)
    return tuple(dict.fromkeys(_name(node) or "" for node in found))


def renamed(expression: str, rename: Callable[[str], str]) -> str:
    """Return an expression with each dotted name as ``rename`` has it; raises BadExpression.

    >>> renamed("a.rate * 2 <= b.rate", lambda name: f"left.{name}")
    'left.a.rate * 2 <= left.b.rate'
    """
    found: list[ast.expr] = []
    _walk(_parsed(expression), found)
    lines = [line.encode() for line in expression.strip().splitlines(keepends=True)]
    for node in sorted(found, key=lambda node: (node.lineno, node.col_offset), reverse=True):
        before, behind = lines[node.lineno - 1][: node.col_offset], lines[(node.end_lineno or 0) - 1]
        new = rename(_name(node) or "").encode()
        lines[node.lineno - 1 : node.end_lineno] = [before + new + behind[node.end_col_offset or 0 :]]
    return b"".join(lines).decode()


def value_of(expression: str, lookup: Callable[[str], object]) -> object:
    """Return what an expression is worth where ``lookup`` gives the value of a dotted name; raises BadExpression."""
    try:
        return _value(_parsed(expression), lookup)
    except (TypeError, ZeroDivisionError, OverflowError) as error:
        raise BadExpression(str(error)) from None


def _parsed(expression: str) -> ast.expr:
    if len(expression) > LONGEST:
        raise BadExpression(f"is {len(expression)} characters long, may be {LONGEST}")
    try:
        return ast.parse(expression.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        why = error.msg if isinstance(error, SyntaxError) else str(error)
        raise BadExpression(f"cannot be read: {why}") from None


def _name(node: ast.expr) -> str | None:
    parts = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return ".".join(reversed([*parts, node.id])) if isinstance(node, ast.Name) and parts else None


def _walk(node: ast.expr, found: list[ast.expr]) -> None:
    if _name(node) is not None:
        found.append(node)
        return
    for part in _parts(node):
        _walk(part, found)


def _parts(node: ast.expr) -> list[ast.expr]:
    """Return the parts of a node, in their order; raises BadExpression for a node that has no place here."""
    if isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float | str):
        if isinstance(node.value, int | float) and abs(node.value) > sys.float_info.max:
            raise BadExpression("holds a number that is too large: it goes to about 1.8e308")
        return []
    if isinstance(node, ast.BoolOp):
        return node.values
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        return [node.operand]
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        return [node.left, node.right]
    if isinstance(node, ast.Compare) and all(type(op) in OPERATORS for op in node.ops):
        return [node.left, *node.comparators]
    raise BadExpression(f"{ast.unparse(node)!r} has no place in a constraint")


def _value(node: ast.expr, lookup: Callable[[str], object]) -> Any:
    name = _name(node)
    if name is not None:
        return lookup(name)
    parts = _parts(node)
    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.BoolOp):
        values = (_value(part, lookup) for part in parts)
        return all(values) if isinstance(node.op, ast.And) else any(values)
    if isinstance(node, ast.UnaryOp):
        value = _value(parts[0], lookup)
        return not value if isinstance(node.op, ast.Not) else -value
    values_of_parts = [_value(part, lookup) for part in parts]
    if isinstance(node, ast.BinOp):
        return OPERATORS[type(node.op)](*values_of_parts)
    assert isinstance(node, ast.Compare)
    pairs = zip(node.ops, values_of_parts, values_of_parts[1:], strict=False)
    return all(OPERATORS[type(op)](left, right) for op, left, right in pairs)
