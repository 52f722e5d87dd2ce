"""The words in which constraints are written, as plain data, and the rules that they come to.

- ``{"forbid": WHEN}``: not all of this at once
- ``{"if": WHEN, "then": WHEN}``: where all of the one is so, all of the other must be so
- ``{"compare": [SLOT, OPERATOR, SLOT or number]}``: two slots, or one and a number

``WHEN`` maps names of slots to tests, which must all hold: an alternative; a list of alternatives, of which it must be
one; or ``{OPERATOR: value}``, several of which must all hold. ``OPERATOR`` is ``<``, ``<=``, ``>``, ``>=``, ``==`` or
``!=``; all but the last two are for numbers. Where a slot holds several alternatives, one of them must pass the test.
``"because"`` may give the reason, and is shown where the constraint excludes something. An alternative that a slot does
not have is an error, since it would be a misspelling.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

import numpy as np

from regraft.adaptation_manager.planners.choices.rules.rules import Clause, Rule, relation
from regraft.adaptation_manager.planners.choices.settings import identity
from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.suggestions import no_such

FORMS: Final = ({"forbid"}, {"if", "then"}, {"compare"})
ORDERS: Final[dict[str, Callable[[Any, Any], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
OPERATORS: Final = (*ORDERS, "==", "!=")


def rules_of(constraints: Sequence[PlainValue], slots: Sequence[Slot], noun: str = "dimension") -> list[Rule]:
    """Return what constraints come to; raises BadMessage naming what is wrong, and where.

    ``noun`` is the word that the constraints' author has for a slot.
    """
    reader = Reader(slots, noun)
    rules: list[Rule] = []
    for index, constraint in enumerate(constraints):
        try:
            rules += reader.read(index, constraint)
        except BadMessage as error:
            raise error.inside(str(index)) from None
    return rules


class Reader:
    """Reads constraints on some slots."""

    def __init__(self, slots: Sequence[Slot], noun: str) -> None:
        self._slots = slots
        self._noun = noun
        self._index = {slot.name: index for index, slot in enumerate(slots)}

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
            raise BadMessage(no_such(self._noun, str(name), self._index))
        return self._index[name]

    def _parts(self, when: PlainValue) -> list[tuple[int, int]]:
        if not isinstance(when, dict) or not when:
            raise BadMessage(f"must map names of {self._noun}s to what they are")
        return [self._part(name, test) for name, test in when.items()]

    def _part(self, name: str, test: PlainValue) -> tuple[int, int]:
        try:
            index = self._find(name)
            return index, _mask(self._slots[index], test)
        except BadMessage as error:
            raise error.inside(name) from None

    def _opposite(self, parts: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
        return [(index, _all_of(self._slots[index]) & ~mask) for index, mask in parts]

    def _comparison(self, source: int, given: PlainValue) -> Rule:
        if not isinstance(given, list | tuple) or len(given) != 3:
            raise BadMessage(f"must be [{self._noun}, operator, {self._noun} or number]")
        left, sign, right = given
        if sign not in OPERATORS:
            raise BadMessage(f"there is no operator {sign!r}; there are: {' '.join(OPERATORS)}")
        first = self._find(left)
        if not isinstance(right, str):
            return Clause(source, ((first, _compared(self._slots[first], sign, right)),))
        second = self._find(right)
        if first == second:
            raise BadMessage(f"compares {left!r} with itself")
        one, other = self._slots[first], self._slots[second]
        several = next((slot.name for slot in (one, other) if not slot.is_single), None)
        if several is not None:
            raise BadMessage(f"{several!r} may hold several alternatives, which cannot be compared with another's")
        together = [[_holds(one, a, sign, b, other) for b in other.values] for a in one.values]
        return relation(source, first, second, np.array(together, dtype=bool))


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


def _all_of(slot: Slot) -> int:
    return (1 << len(slot.selections)) - 1


def _mask(slot: Slot, test: PlainValue) -> int:
    """Return the selections of a slot that pass a test."""
    if isinstance(test, dict):
        if not test or any(sign not in OPERATORS for sign in test):
            raise BadMessage(f"is {sorted(test)}, must be a value, a list of values, or have: {' '.join(OPERATORS)}")
        mask = _all_of(slot)
        for sign, value in test.items():
            mask &= _compared(slot, sign, value)
        return mask
    if isinstance(test, list | tuple) and slot.index_of(test) is None:
        if not test:
            raise BadMessage("is an empty list of values")
        return slot.with_alternatives(sum(1 << index for index in {_index(slot, value) for value in test}))
    return slot.with_alternatives(1 << _index(slot, test))


def _index(slot: Slot, value: PlainValue) -> int:
    index = slot.index_of(value)
    if index is None:
        choices = ", ".join(str(alternative.name) for alternative in slot.alternatives)
        raise BadMessage(f"{value!r} is none of its choices, which are: {choices}")
    return index


def _compared(slot: Slot, sign: str, value: PlainValue) -> int:
    if sign in ORDERS:
        names = [alternative.name for alternative in slot.alternatives]
        return slot.with_alternatives(sum(1 << i for i, name in enumerate(names) if _holds(slot, name, sign, value)))
    same = slot.with_alternatives(1 << _index(slot, value))
    return same if sign == "==" else _all_of(slot) & ~same


def _holds(one: Slot, a: PlainValue, sign: str, b: PlainValue, other: Slot | None = None) -> bool:
    if sign in ORDERS:
        for value, owner in ((a, one), (b, other)):
            if isinstance(value, bool) or not isinstance(value, int | float):
                whose = f"{owner.name!r} has {value!r}" if owner else f"{value!r} is given"
                raise BadMessage(f"{sign!r} is for numbers, but {whose}")
        return ORDERS[sign](a, b)
    return (identity(a) == identity(b)) == (sign == "==")
