"""SWRL's built-ins that rules may use: comparisons and arithmetic.

Values of different kinds have no order, so that each comparison of them but ``notEqual`` fails. Individuals have
none either, and differ by ``differentFrom`` alone.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from typing import Any, Final

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import NUMBER, TEXT, Data, Term, number


def _ordered(test: Callable[[Any, Any], bool]) -> Callable[[Term, Term], bool]:
    def compare(left: Term, right: Term) -> bool:
        if not (isinstance(left, Data) and isinstance(right, Data)):
            return False
        return left.kind == right.kind and left.kind in {NUMBER, TEXT} and test(left.value, right.value)

    return compare


def _equal(left: Term, right: Term) -> bool:
    return isinstance(left, Data) and left == right


def _not_equal(left: Term, right: Term) -> bool:
    return isinstance(left, Data) and isinstance(right, Data) and left != right


COMPARISONS: Final[dict[str, Callable[[Term, Term], bool]]] = {
    "equal": _equal,
    "notEqual": _not_equal,
    "lessThan": _ordered(operator.lt),
    "lessThanOrEqual": _ordered(operator.le),
    "greaterThan": _ordered(operator.gt),
    "greaterThanOrEqual": _ordered(operator.ge),
}
ARITHMETIC: Final[dict[str, Callable[[Sequence[float]], float]]] = {
    "add": math.fsum,
    "subtract": lambda values: values[0] - values[1],
    "multiply": math.prod,
}
NAMES: Final = (*COMPARISONS, *ARITHMETIC)


def compute(name: str, terms: Sequence[Term]) -> Data | None:
    """Return the result of an arithmetic built-in, None unless all terms are numbers and the result is finite."""
    values: list[float] = []
    for term in terms:
        if not isinstance(term, Data) or term.kind != NUMBER:
            return None
        values.append(float(term.value))
    try:
        return number(ARITHMETIC[name](values))
    except (ValueError, OverflowError):
        return None


def arity_problem(name: str, count: int) -> str:
    """Return what is wrong with a built-in's number of arguments, empty if nothing is."""
    if name in COMPARISONS:
        return "" if count == 2 else f"{name} has {count} arguments, must have 2"
    if name == "subtract":
        return "" if count == 3 else f"{name} has {count} arguments, must have 3"
    return "" if count >= 3 else f"{name} has {count} arguments, must have 3 or more"
