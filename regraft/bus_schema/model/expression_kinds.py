"""The kinds of values in expressions: what is a condition, what is a number, and what can never be computed."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Mapping

from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.model.description import ParameterDescription
from regraft.bus_schema.model.expressions import KNOWN, Expression

Kinds = Mapping[str, ValueKind]
"""The kinds of names; one that is left out may be of any."""
NO_KINDS: Kinds = {}
OF_SCHEMAS = {
    "boolean": ValueKind.TRUTH,
    "integer": ValueKind.NUMBER,
    "number": ValueKind.NUMBER,
    "string": ValueKind.TEXT,
}


def kind_of(expression: Expression, kinds: Kinds = NO_KINDS) -> ValueKind | None:
    """Return the kind of an expression's value, None if it may be any."""
    return _Reader(kinds).kind(expression.root)


def kind_problems(expression: Expression, kinds: Kinds = NO_KINDS, wanted: ValueKind | None = None) -> list[str]:
    """Return what is of the wrong kind in an expression whose value is ``wanted`` to be of a kind.

    True and false are numbers, too: 1 and 0. A condition is true or false, and nothing else is.
    """
    reader = _Reader(kinds)
    if wanted is ValueKind.TRUTH:
        reader.condition(expression.root)
    elif wanted is ValueKind.NUMBER:
        reader.number(expression.root)
    else:
        reader.kind(expression.root)
    return list(dict.fromkeys(reader.problems))


def kind_of_parameter(parameter: ParameterDescription) -> ValueKind | None:
    """Return the kind of a parameter's values, None if it may be any."""
    wanted = parameter.schema.get("type")
    return OF_SCHEMAS.get(wanted) if isinstance(wanted, str) else None


class _Reader:
    """Finds the kind of each part of an expression, and notes what does not fit."""

    def __init__(self, kinds: Kinds) -> None:
        self._kinds = kinds
        self.problems: list[str] = []

    def condition(self, node: ast.expr) -> ValueKind:
        """Note a part that has to be true or false, and is not."""
        kind = self.kind(node)
        if kind not in (None, ValueKind.TRUTH):
            self.problems.append(f"{ast.unparse(node)} is {kind.value}, must be {_condition_like(node, kind)}")
        return ValueKind.TRUTH

    def number(self, node: ast.expr) -> ValueKind:
        """Note a part that has to be a number, and is not."""
        return self._number_of_kind(node, self.kind(node))

    def _number_of_kind(self, node: ast.expr, kind: ValueKind | None) -> ValueKind:
        if kind in (ValueKind.TEXT, ValueKind.LIST):
            self.problems.append(f"{ast.unparse(node)} is {kind.value}, must be a number")
        return ValueKind.NUMBER

    def kind(self, node: ast.expr) -> ValueKind | None:
        """Return the kind of a part, None if it may be any."""
        match node:
            case ast.Constant(value=value):
                return _kind_of_constant(value)
            case ast.BoolOp(values=values):
                for part in values:
                    self.condition(part)
                return ValueKind.TRUTH
            case ast.UnaryOp(op=op, operand=operand):
                return self.condition(operand) if isinstance(op, ast.Not) else self.number(operand)
            case ast.BinOp(left=left, op=op, right=right):
                return self._calculated(left, op, right)
            case ast.Compare(left=left, comparators=comparators):
                for pair in itertools.pairwise([left, *comparators]):
                    self._compare(*pair)
                return ValueKind.TRUTH
            case ast.IfExp(test=test, body=body, orelse=orelse):
                self.condition(test)
                return self._either(body, orelse)
            case ast.Call(func=func, args=args):
                return self._called(ast.unparse(func), args)
        return self._kinds.get(ast.unparse(node))

    def _calculated(self, left: ast.expr, op: ast.operator, right: ast.expr) -> ValueKind | None:
        first, second = self.kind(left), self.kind(right)
        if isinstance(op, ast.Add) and {first, second} <= {ValueKind.TEXT, None}:
            return first or second
        self._number_of_kind(left, first)
        return self._number_of_kind(right, second)

    def _compare(self, one: ast.expr, other: ast.expr) -> None:
        first, second = self.kind(one), self.kind(other)
        fits = (first is ValueKind.TEXT) == (second is ValueKind.TEXT) and ValueKind.LIST not in (first, second)
        if first is not None and second is not None and not fits:
            pair = f"{ast.unparse(one)}, {first.value}, is compared with {ast.unparse(other)}, {second.value}"
            self.problems.append(f"{pair}: both must be of one kind")

    def _either(self, one: ast.expr, other: ast.expr) -> ValueKind | None:
        first, second = self.kind(one), self.kind(other)
        return first if first is second else None

    def _called(self, function: str, arguments: list[ast.expr]) -> ValueKind | None:
        if function == KNOWN:
            return self._either(*arguments)
        kinds = [self.kind(argument) for argument in arguments]
        if function in ("min", "max") and (len(arguments) == 1 or {*kinds} <= {ValueKind.TEXT, None}):
            return kinds[0] if len(arguments) > 1 and len({*kinds}) == 1 else None
        for argument, kind in zip(arguments, kinds, strict=True):
            self._number_of_kind(argument, kind)
        return ValueKind.NUMBER


def _kind_of_constant(value: object) -> ValueKind:
    if isinstance(value, bool):
        return ValueKind.TRUTH
    return ValueKind.TEXT if isinstance(value, str) else ValueKind.NUMBER


def _condition_like(node: ast.expr, kind: ValueKind) -> str:
    """Return in words which condition a part may have been meant as."""
    text, name = ast.unparse(node), "NAME" if isinstance(node, ast.Constant) else ""
    if kind is ValueKind.NUMBER:
        return f"true or false, such as: {name} > {text}" if name else f"true or false, such as: {text} > 0"
    if kind is ValueKind.TEXT:
        return f"true or false, such as: {name} == {text}" if name else f"true or false, such as: {text} == 'a text'"
    return "true or false"
