"""Expressions over known numbers and texts, such as ``navigator.safety * navigator.speed / 0.26``.

Python's arithmetic, comparisons, ``and``, ``or``, ``not`` and ``a if b else c``, and the functions below; names may
have dots. A name that is not known makes the whole unknown, except within ``known(name, otherwise)``.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any, Final

from regraft.bus_schema.errors import BadMessage

Value = float | str | bool
LONGEST: Final = 2000
MAX_NODES: Final = 400
KNOWN: Final = "known"
ARITHMETIC: Final[dict[type[ast.AST], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
COMPARISONS: Final[dict[type[ast.AST], Callable[[Any, Any], Any]]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
FUNCTIONS: Final[dict[str, Callable[..., float]]] = {
    "min": min,
    "max": max,
    "abs": abs,
    "hypot": math.hypot,
    "atan2": math.atan2,
    "turned": lambda angle: math.remainder(angle, math.tau),
}
"""``turned`` is an angle (rad) within half a turn."""
FORMS: Final = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.USub, ast.Not, ast.BoolOp, ast.And, ast.Or, ast.Compare, ast.IfExp,
    ast.Call, ast.Name, ast.Attribute, ast.Load, ast.Constant, *ARITHMETIC, *COMPARISONS,
)  # fmt: skip


class Unknown(Exception):
    """A value cannot be told; the text says why."""


class Expression:
    """An expression that has been checked."""

    def __init__(self, text: str) -> None:
        """Check a text; raises BadMessage saying what is wrong with it."""
        self.text = text
        if len(text) > LONGEST:
            raise BadMessage(f"has {len(text)} characters, must have at most {LONGEST}")
        try:
            tree = ast.parse(text.strip(), mode="eval")
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise BadMessage(f"{text!r} is no expression: {getattr(error, 'msg', error)}") from None
        nodes = list(ast.walk(tree))
        if len(nodes) > MAX_NODES:
            raise BadMessage(f"has {len(nodes)} parts, must have at most {MAX_NODES}")
        for node in nodes:
            _check(node)
        self._root = tree.body

    def value(self, names: Mapping[str, Value]) -> Value:
        """Return the value where names have these values; raises Unknown."""
        try:
            found: Value = _value(self._root, names)
        except (ArithmeticError, TypeError, ValueError) as error:
            raise Unknown(f"{self.text!r}: {error}") from None
        if isinstance(found, float) and not math.isfinite(found):
            raise Unknown(f"{self.text!r} is not finite")
        return found

    def number(self, names: Mapping[str, Value]) -> float:
        """Return the value as a number, true being 1; raises Unknown."""
        found = self.value(names)
        if isinstance(found, str):
            raise Unknown(f"{self.text!r} is the text {found!r}, must be a number")
        return float(found)


def _check(node: ast.AST) -> None:
    if not isinstance(node, FORMS):
        raise BadMessage(f"{type(node).__name__} has no place in an expression")
    if isinstance(node, ast.Constant) and not isinstance(node.value, int | float | str | bool):
        raise BadMessage(f"{node.value!r} is no number or text")
    if isinstance(node, ast.Attribute | ast.Name):
        _name(node)
    if isinstance(node, ast.Call):
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        if called not in (*FUNCTIONS, KNOWN) or node.keywords:
            raise BadMessage(f"{ast.unparse(node.func)!r} is no function; there are: {', '.join((*FUNCTIONS, KNOWN))}")
        if called == KNOWN and len(node.args) != 2:
            raise BadMessage("known takes a value and what it is otherwise")


def _name(node: ast.expr) -> str:
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        return f"{_name(node.value)}.{node.attr}"
    raise BadMessage(f"{ast.unparse(node)!r} is no name")


def _value(node: ast.expr, names: Mapping[str, Value]) -> Any:
    match node:
        case ast.Constant(value=value):
            return value
        case ast.Name() | ast.Attribute():
            name = _name(node)
            if name not in names:
                raise Unknown(f"{name} is not known")
            return names[name]
        case ast.BinOp(left=left, op=op, right=right):
            return ARITHMETIC[type(op)](_value(left, names), _value(right, names))
        case ast.UnaryOp(op=op, operand=operand):
            value = _value(operand, names)
            return not value if isinstance(op, ast.Not) else -value
        case ast.BoolOp(op=op, values=values):
            parts = (bool(_value(part, names)) for part in values)
            return all(parts) if isinstance(op, ast.And) else any(parts)
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return _value(body if _value(test, names) else orelse, names)
        case ast.Compare(left=left, ops=ops, comparators=comparators):
            values = [_value(part, names) for part in (left, *comparators)]
            return all(COMPARISONS[type(op)](a, b) for op, a, b in zip(ops, values, values[1:], strict=False))
        case ast.Call(func=func, args=args):
            return _called(_name(func), args, names)
        case _:
            raise Unknown(f"{ast.unparse(node)!r} cannot be told")


def _called(function: str, args: list[ast.expr], names: Mapping[str, Value]) -> Any:
    if function == KNOWN:
        try:
            return _value(args[0], names)
        except Unknown:
            return _value(args[1], names)
    return FUNCTIONS[function](*(_value(arg, names) for arg in args))
