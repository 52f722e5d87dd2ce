"""Takes an objective apart: named parts put in, sums multiplied out, so that each summand ties few slots together."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from typing import Final

from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.expressions import Expression

MAX_SUMMANDS: Final = 400
MAX_DEPTH: Final = 20
"""How deeply named expressions may speak of each other."""


def summands(expression: Expression, named: Mapping[str, Expression] | None = None) -> tuple[Expression, ...]:
    """Return expressions whose sum is the expression, with the expressions of ``named`` in the place of their names.

    >>> [each.text for each in summands(Expression("w * (a - b) / 2"))]
    ['w * a / 2', 'w * -b / 2']

    Raises:
        BadMessage: named expressions speak of each other in a circle, or all together are too long.
    """
    found: list[ast.expr] = []
    for part in _split(inlined(expression, named or {})):
        found.append(part)
        if len(found) > MAX_SUMMANDS:
            raise BadMessage(f"comes to more than {MAX_SUMMANDS} summands: give fewer")
    return tuple(Expression(ast.unparse(part)) for part in found)


def inlined(expression: Expression, named: Mapping[str, Expression]) -> ast.expr:
    """Return an expression's tree with named expressions in the place of their names; raises BadMessage."""
    return _inlined(_root(expression), named, ())


def _root(expression: Expression) -> ast.expr:
    return ast.parse(expression.text.strip(), mode="eval").body


def _inlined(node: ast.expr, named: Mapping[str, Expression], within: tuple[str, ...]) -> ast.expr:
    class Inliner(ast.NodeTransformer):
        def visit_Name(self, node: ast.Name) -> ast.expr:
            return self._replaced(node)

        def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
            return self._replaced(node)

        def visit_Call(self, node: ast.Call) -> ast.expr:
            node.args = [self.visit(argument) for argument in node.args]
            return node

        def _replaced(self, node: ast.expr) -> ast.expr:
            name = ast.unparse(node)
            if name not in named:
                return node
            if name in within or len(within) >= MAX_DEPTH:
                raise BadMessage(f"{' -> '.join([*within, name])}: is defined by itself", (name,))
            return _inlined(_root(named[name]), named, (*within, name))

    found: ast.expr = Inliner().visit(node)
    return found


def _split(node: ast.expr) -> Iterator[ast.expr]:
    match node:
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() as op, right=right):
            yield from _split(left)
            yield from _split(right) if isinstance(op, ast.Add) else map(_negative, _split(right))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            yield from map(_negative, _split(operand))
        case ast.BinOp(left=left, op=ast.Mult() as op, right=right):
            rights = list(_split(right))
            yield from (ast.BinOp(one, op, other) for one in _split(left) for other in rights)
        case ast.BinOp(left=left, op=ast.Div() as op, right=right):
            yield from (ast.BinOp(one, op, right) for one in _split(left))
        case _:
            yield node


def _negative(node: ast.expr) -> ast.expr:
    return ast.UnaryOp(ast.USub(), node)
