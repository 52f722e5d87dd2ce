"""The words in which constraints are written, as plain data, and the rules that they come to.

- ``{"forbid": WHEN}``: not all of this at once
- ``{"if": WHEN, "then": WHEN}``: where all of the one is so, all of the other must be so
- ``{"compare": [DIMENSION, OPERATOR, DIMENSION or number]}``: two dimensions, or one and a number

``WHEN`` maps names of dimensions to tests, which must all hold: a value; a list of values, of which it must be one;
or ``{OPERATOR: value}``, several of which must all hold. ``OPERATOR`` is ``<``, ``<=``, ``>``, ``>=``, ``==`` or
``!=``; all but the last two are for numbers. ``"because"`` may say why, and is shown where the constraint stands in
the way. A value that a dimension does not have is an error, since it would be a misspelling.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

from regraft.adaptation_manager.planners.bandits.dimensions import Dimension, identity
from regraft.adaptation_manager.planners.bandits.search import Clause, Relation, Rule
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.suggestions import instead_of

FORMS: Final = ({"forbid"}, {"if", "then"}, {"compare"})
ORDERS: Final[dict[str, Callable[[Any, Any], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
OPERATORS: Final = (*ORDERS, "==", "!=")


def rules_of(constraints: Sequence[PlainValue], dimensions: Sequence[Dimension]) -> list[Rule]:
    """Return what constraints come to; raises BadMessage naming what is wrong, and where."""
    reader = Reader(dimensions)
    rules: list[Rule] = []
    for index, constraint in enumerate(constraints):
        try:
            rules += reader.read(index, constraint)
        except BadMessage as error:
            raise error.inside(str(index)) from None
    return rules


class Reader:
    """Reads constraints on some dimensions."""

    def __init__(self, dimensions: Sequence[Dimension]) -> None:
        self._dimensions = dimensions
        self._index = {dimension.name: index for index, dimension in enumerate(dimensions)}

    def read(self, source: int, constraint: PlainValue) -> list[Rule]:
        """Return the rules of one constraint; raises BadMessage."""
        if not isinstance(constraint, dict) or constraint.keys() - {"because"} not in FORMS:
            found = sorted(constraint) if isinstance(constraint, dict) else type(constraint).__name__
            raise BadMessage(f"is {found}, must have 'forbid', or 'if' and 'then', or 'compare' (and may 'because')")
        if not isinstance(constraint.get("because", ""), str):
            raise BadMessage("must be text", ("because",))
        if "compare" in constraint:
            return [_at("compare", lambda: self._comparison(source, constraint["compare"]))]
        if "forbid" in constraint:
            parts = _at("forbid", lambda: self._parts(constraint["forbid"]))
            return [_clause(source, self._opposite(parts))]
        conditions = _at("if", lambda: self._parts(constraint["if"]))
        consequences = _at("then", lambda: self._parts(constraint["then"]))
        return [_clause(source, [*self._opposite(conditions), part]) for part in consequences]

    def _find(self, name: PlainValue) -> int:
        if not isinstance(name, str) or name not in self._index:
            raise BadMessage(f"there is no dimension {name!r}; {instead_of(str(name), self._index)}")
        return self._index[name]

    def _parts(self, when: PlainValue) -> list[tuple[int, int]]:
        if not isinstance(when, dict) or not when:
            raise BadMessage("must map names of dimensions to what they are")
        return [self._part(name, test) for name, test in when.items()]

    def _part(self, name: str, test: PlainValue) -> tuple[int, int]:
        try:
            index = self._find(name)
            return index, _mask(self._dimensions[index], test)
        except BadMessage as error:
            raise error.inside(name) from None

    def _opposite(self, parts: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
        return [(index, _all_of(self._dimensions[index]) & ~mask) for index, mask in parts]

    def _comparison(self, source: int, given: PlainValue) -> Rule:
        if not isinstance(given, list | tuple) or len(given) != 3:
            raise BadMessage("must be [dimension, operator, dimension or number]")
        left, sign, right = given
        if sign not in OPERATORS:
            raise BadMessage(f"there is no operator {sign!r}; there are: {' '.join(OPERATORS)}")
        first = self._find(left)
        if not isinstance(right, str):
            return Clause(source, ((first, _compared(self._dimensions[first], sign, right)),))
        second = self._find(right)
        if first == second:
            raise BadMessage(f"compares {left!r} with itself")
        one, other = self._dimensions[first], self._dimensions[second]
        partners = tuple(
            sum(1 << j for j, b in enumerate(other.choices) if _holds(one, a, sign, b, other)) for a in one.choices
        )
        reverse = tuple(
            sum(1 << i for i, mask in enumerate(partners) if mask >> j & 1) for j in range(len(other.choices))
        )
        return Relation(source, first, second, partners, reverse)


def _at(field: str, read: Callable[[], Any]) -> Any:
    try:
        return read()
    except BadMessage as error:
        raise error.inside(field) from None


def _clause(source: int, parts: Iterable[tuple[int, int]]) -> Clause:
    ways: dict[int, int] = {}
    for index, mask in parts:
        ways[index] = ways.get(index, 0) | mask
    return Clause(source, tuple(ways.items()))


def _all_of(dimension: Dimension) -> int:
    return (1 << len(dimension.choices)) - 1


def _mask(dimension: Dimension, test: PlainValue) -> int:
    """Return the choices of a dimension that pass a test."""
    if isinstance(test, dict):
        if not test or any(sign not in OPERATORS for sign in test):
            raise BadMessage(f"is {sorted(test)}, must be a value, a list of values, or have: {' '.join(OPERATORS)}")
        mask = _all_of(dimension)
        for sign, value in test.items():
            mask &= _compared(dimension, sign, value)
        return mask
    if isinstance(test, list | tuple) and dimension.index_of(test) is None:
        if not test:
            raise BadMessage("is an empty list of values")
        return sum(1 << index for index in {_index(dimension, value) for value in test})
    return 1 << _index(dimension, test)


def _index(dimension: Dimension, value: PlainValue) -> int:
    index = dimension.index_of(value)
    if index is None:
        raise BadMessage(f"{value!r} is none of its choices, which are: {', '.join(map(str, dimension.choices))}")
    return index


def _compared(dimension: Dimension, sign: str, value: PlainValue) -> int:
    if sign in ORDERS:
        return sum(1 << i for i, choice in enumerate(dimension.choices) if _holds(dimension, choice, sign, value))
    same = 1 << _index(dimension, value)
    return same if sign == "==" else _all_of(dimension) & ~same


def _holds(one: Dimension, a: PlainValue, sign: str, b: PlainValue, other: Dimension | None = None) -> bool:
    if sign in ORDERS:
        for value, owner in ((a, one), (b, other)):
            if isinstance(value, bool) or not isinstance(value, int | float):
                whose = f"{owner.name!r} has {value!r}" if owner else f"{value!r} is given"
                raise BadMessage(f"{sign!r} is for numbers, but {whose}")
        return ORDERS[sign](a, b)
    return (identity(a) == identity(b)) == (sign == "==")
