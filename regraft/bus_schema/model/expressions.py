"""Expressions over named values, for constraints (``a.rate * 2 <= b.rate or not c.active``) and forecasts.

They are written as in Python, of a few parts only: numbers, texts, ``True``, ``False``, and names with dots. They have
``+ - * /``, comparisons (also chained), ``and``, ``or``, ``not``, ``a if b else c``, brackets, and the functions
below. A name without a value makes the whole unknown, except within ``known(name, otherwise)``.
"""

from __future__ import annotations

import ast
import itertools
import math
import operator
import sys
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from regraft.bus_schema.errors import BadMessage

MAX_LENGTH: Final = 2000
MAX_PARTS: Final = 400
MAX_DEPTH: Final = 140
TOO_DEEP: Final = f"is nested more than {MAX_DEPTH} deep"
KNOWN: Final = "known"


def _product(left: Any, right: Any) -> Any:
    """Return a product of numbers; Python repeats texts and lists, to any length."""
    if not isinstance(left, int | float) or not isinstance(right, int | float):
        raise TypeError(f"cannot multiply {type(left).__name__} by {type(right).__name__}")
    return left * right


OPERATORS: Final[dict[type[ast.AST], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: _product,
    ast.Div: operator.truediv,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {
    "min": min,
    "max": max,
    "abs": abs,
    "hypot": math.hypot,
    "atan2": math.atan2,
    "turned": lambda angle: math.remainder(angle, math.tau),
}
"""``turned`` is an angle (rad) within half a turn."""

COUNTS: Final[dict[str, tuple[int, float]]] = {"abs": (1, 1), "atan2": (2, 2), "turned": (1, 1)}
"""How many values functions take, at least and at most; the others take any, but for none."""


class Unknown(Exception):
    """A name has no value; the text states which."""


class NotComputable(Unknown):
    """The values that there are do not fit the expression; the text states why."""


class Expression:
    """An expression that has been checked.

    Attributes:
        text: as it was written.
        names: the names that it speaks of, each once, in their order.
        constants: the numbers, texts and truths that it holds.
        root: its syntax tree, which nobody changes.
    """

    def __init__(self, text: str) -> None:
        """Check a text; raises BadMessage stating what is wrong with it."""
        self.text = text
        if len(text) > MAX_LENGTH:
            raise BadMessage(f"has {len(text)} characters, must have at most {MAX_LENGTH}")
        try:
            self.root: ast.expr = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise BadMessage(f"{text!r} is no expression: {getattr(error, 'msg', error)}") from None
        try:
            self._parts = parts = list(_walk(self.root))
        except RecursionError:  # in what shows a part that has no place here
            raise BadMessage(TOO_DEEP) from None
        if len(parts) > MAX_PARTS:
            raise BadMessage(f"has {len(parts)} parts, must have at most {MAX_PARTS}")
        self.names = tuple(dict.fromkeys(name for part in parts if (name := _name(part)) is not None))
        held: list[Any] = [part for part in parts if isinstance(part, ast.Constant)]
        self.constants: tuple[Any, ...] = tuple(part.value for part in held)

    def renamed(
        self, rename: Callable[[str], str], text: Callable[[str, str], str] = lambda name, compared: compared
    ) -> str:
        """Return the text with each name as ``rename`` has it.

        A text that is compared with a name becomes what ``text`` makes of both.

        >>> Expression("a.rate * 2 <= b.rate").renamed(lambda name: f"left.{name}")
        'left.a.rate * 2 <= left.b.rate'
        >>> Expression("mode == 'slow'").renamed(lambda name: f"left.{name}", lambda name, compared: f"left/{compared}")
        "left.mode == 'left/slow'"
        """
        lines = self.text.strip().encode().splitlines(keepends=True)  # as the parser ends them
        new = {part: rename(name) for part in self._parts if (name := _name(part)) is not None}
        for name, held in self._comparisons():
            found = text(name, held.value) if isinstance(held.value, str) else held.value
            if found != held.value:
                new[held] = repr(found)
        for node in sorted(new, key=lambda node: (node.lineno, node.col_offset), reverse=True):
            first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
            put = lines[first][: node.col_offset] + new[node].encode() + lines[last][node.end_col_offset or 0 :]
            lines[first : last + 1] = [put]
        return b"".join(lines).decode()

    def compared(self) -> Iterator[tuple[str, Any]]:
        """Yield each name that is compared with a constant, and the constant.

        >>> list(Expression("laser.state == 'gone' or 0.3 > laser.clearness").compared())
        [('laser.state', 'gone'), ('laser.clearness', 0.3)]
        """
        return ((name, held.value) for name, held in self._comparisons())

    def _comparisons(self) -> Iterator[tuple[str, ast.Constant]]:
        for part in self._parts:
            sides = [part.left, *part.comparators] if isinstance(part, ast.Compare) else []
            for one, other in itertools.pairwise(sides):
                for named, held in ((one, other), (other, one)):
                    name = _name(named)
                    if name is not None and isinstance(held, ast.Constant):
                        yield name, held

    def value(self, names: Mapping[str, Any]) -> Any:
        """Return the value where names have these values; raises Unknown, and BadMessage if the mapping does."""
        try:
            found = _value(self.root, names)
            if isinstance(found, int | float) and not math.isfinite(found):
                raise ArithmeticError("is not finite")
        except BadMessage:
            raise
        except (ArithmeticError, TypeError, ValueError) as error:
            raise NotComputable(f"{self.text!r}: {error}") from None
        return found

    def number(self, names: Mapping[str, Any]) -> float:
        """Return the value as a number, true being 1; raises Unknown."""
        found = self.value(names)
        if not isinstance(found, int | float):
            raise NotComputable(f"{self.text!r} is {found!r}, must be a number")
        return float(found)


def _walk(node: ast.expr, depth: int = 1) -> Iterator[ast.expr]:
    """Yield a node and all below it; raises BadMessage for one that has no place in an expression."""
    if depth > MAX_DEPTH:
        raise BadMessage(TOO_DEEP)
    yield node
    for part in _parts(node):
        yield from _walk(part, depth + 1)


def _parts(node: ast.expr) -> list[ast.expr]:
    match node:
        case ast.Constant(value=bool() | int() | float() | str() as value):
            if isinstance(value, int | float) and abs(value) > sys.float_info.max:
                raise BadMessage("holds a number that is too large: it goes to about 1.8e308")
            return []
        case ast.BoolOp():
            return node.values
        case ast.UnaryOp(op=ast.Not() | ast.USub()):
            return [node.operand]
        case ast.BinOp() if type(node.op) in OPERATORS:
            return [node.left, node.right]
        case ast.Compare() if all(type(op) in OPERATORS for op in node.ops):
            return [node.left, *node.comparators]
        case ast.IfExp():
            return [node.test, node.body, node.orelse]
        case ast.Call():
            return _arguments(node)
        case _ if _name(node) is not None:
            return []
    raise BadMessage(f"{ast.unparse(node)!r} has no place in an expression")


def _arguments(call: ast.Call) -> list[ast.expr]:
    function = _name(call.func)
    if function not in (*FUNCTIONS, KNOWN) or call.keywords:
        raise BadMessage(f"{ast.unparse(call.func)!r} is no function; there are: {', '.join((*FUNCTIONS, KNOWN))}")
    if function == KNOWN and len(call.args) != 2:
        raise BadMessage("known takes a value and what it is otherwise")
    least, most = COUNTS.get(function, (1, math.inf))
    if not least <= len(call.args) <= most:
        number = f"{least}" if least == most else f"at least {least}"
        raise BadMessage(f"{ast.unparse(call)!r}: {function} takes {number}, not {len(call.args)} values")
    return call.args


def _name(node: ast.expr) -> str | None:
    """Return the dotted name that a node is, None for anything else."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return ".".join([node.id, *reversed(parts)]) if isinstance(node, ast.Name) else None


def _value(node: ast.expr, names: Mapping[str, Any]) -> Any:
    match node:
        case ast.Constant(value=value):
            return value
        case ast.BoolOp(op=op, values=values):
            truths = (bool(_value(part, names)) for part in values)
            return all(truths) if isinstance(op, ast.And) else any(truths)
        case ast.UnaryOp(op=op, operand=operand):
            value = _value(operand, names)
            return not value if isinstance(op, ast.Not) else -value
        case ast.BinOp(left=left, op=op, right=right):
            return OPERATORS[type(op)](_value(left, names), _value(right, names))
        case ast.Compare(left=left, ops=ops, comparators=comparators):
            compared = [_value(part, names) for part in (left, *comparators)]
            return all(OPERATORS[type(op)](a, b) for op, a, b in zip(ops, compared, compared[1:], strict=False))
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return _value(body if _value(test, names) else orelse, names)
        case ast.Call(func=func, args=args):
            return _call(_name(func), args, names)
    name = _name(node)
    assert name is not None
    try:
        return names[name]
    except KeyError:
        raise Unknown(f"{name} is not known") from None


def _call(function: str | None, args: list[ast.expr], names: Mapping[str, Any]) -> Any:
    if function == KNOWN:
        try:
            return _value(args[0], names)
        except Unknown:
            return _value(args[1], names)
    assert function is not None
    return FUNCTIONS[function](*(_value(arg, names) for arg in args))
