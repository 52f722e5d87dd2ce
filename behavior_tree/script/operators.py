"""The operators of scripts.

Whole numbers are 64-bit and arise from literals and from the board; every calculation gives a real.
"""

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from ..data.values import exact_int, number_text, parse_real
from ..errors import ScriptError

TOLERANCE: Final = 2.0**-23
"""Numbers this close are equal: the machine epsilon of a 32-bit float, as in BehaviorTree.CPP."""

MAX_TEXT: Final = 100_000
"""Characters of a text that a script makes; one that doubles itself would soon fill the memory."""

MAX_VALUES: Final = 100
"""Values that ``min`` and ``max`` compare."""

TRUTH: Final = {"true": 1.0, "false": 0.0}

Operation = Callable[[Any, Any], Any]
Relation = Callable[[Any, Any], bool]


def truth(value: Any) -> bool:
    """Return whether a value counts as true where a condition is wanted.

    Raises:
        ScriptError: The value is a negative number, a whole number other than 0 and 1, or no number at all.
    """
    if isinstance(value, float) and not value < 0.0:
        return value != 0.0
    if isinstance(value, int) and value in (0, 1):
        return value != 0
    raise ScriptError(f"{_shown(value)} is neither true nor false: must be 0, 1, or a real that is not negative")


def chosen(value: Any) -> bool:
    """Return whether a value selects the first branch of ``? :``: a number, or text for one, that is not zero.

    Raises:
        ScriptError: The value is no number.
    """
    if isinstance(value, int | float):
        return value != 0
    if isinstance(value, str):
        try:
            return parse_real(value) != 0
        except ValueError as error:
            raise ScriptError(f"text where '? :' needs a number: {error}") from None
    raise ScriptError(f"{_shown(value)} is no number; one that is not zero selects the first branch of '? :'")


def negate(value: Any) -> float:
    """Return the negative of a number, always as a real."""
    return -float(_number("-", value))


def complement(value: Any) -> float:
    """Return the bitwise complement of a whole number."""
    number = _number("~", value)
    if not math.isfinite(number):
        raise ScriptError(f"'~' does not work on {number}")
    return float(~int(number))


def logical_not(value: Any) -> float:
    """Return 1.0 for zero and 0.0 for any other number."""
    return float(not _number("!", value))


def add(left: Any, right: Any) -> float | str:
    """Return the sum of two numbers, or two texts joined, at most `MAX_TEXT` characters."""
    if isinstance(left, str) and isinstance(right, str):
        return _joined(left, right)
    return float(_number("+", left)) + float(_number("+", right))


def divide(left: Any, right: Any) -> float:
    """Return the quotient of two numbers; as in C++, dividing by zero gives an infinity or not-a-number."""
    dividend, divisor = float(_number("/", left)), float(_number("/", right))
    if divisor != 0.0:
        return dividend / divisor
    if dividend == 0.0 or math.isnan(dividend):
        return math.nan
    return math.copysign(math.inf, dividend) * math.copysign(1.0, divisor)


def join(left: Any, right: Any) -> str:
    """Return texts joined, at most `MAX_TEXT` characters; at most one of them may be a number."""
    if not isinstance(left, str) and not isinstance(right, str):
        raise ScriptError(f"'..' needs a text on one side at least, not {_shown(left)} and {_shown(right)}")
    return _joined(_as_text(left), _as_text(right))


def _joined(left: str, right: str) -> str:
    length = len(left) + len(right)
    if length > MAX_TEXT:
        raise ScriptError(f"the joined text would have {length} characters: at most {MAX_TEXT}")
    return left + right


def _shown(value: Any) -> str:
    return "an empty entry" if value is None else repr(value)


def _as_text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return number_text(_number("..", value))


def _number(symbol: str, value: Any) -> float:
    if not isinstance(value, int | float):
        raise ScriptError(f"'{symbol}' does not work on {_shown(value)}")
    return value


def _real(symbol: str, function: Callable[[float, float], float]) -> Operation:
    def operation(left: Any, right: Any) -> float:
        return function(float(_number(symbol, left)), float(_number(symbol, right)))

    return operation


def _bitwise(symbol: str, function: Callable[[int, int], int]) -> Operation:
    def operation(left: Any, right: Any) -> float:
        try:
            return float(function(exact_int(_number(symbol, left)), exact_int(_number(symbol, right))))
        except ValueError as error:
            raise ScriptError(f"'{symbol}' works on whole numbers only: {error}") from None

    return operation


def _logical(function: Callable[[bool, bool], bool]) -> Operation:
    def operation(left: Any, right: Any) -> float:
        return float(function(truth(left), truth(right)))

    return operation


UNARY: Final[Mapping[str, Callable[[Any], float]]] = {"-": negate, "~": complement, "!": logical_not}

BINARY: Final[Mapping[str, Operation]] = {
    "+": add,
    "-": _real("-", operator.sub),
    "*": _real("*", operator.mul),
    "/": divide,
    "..": join,
    "|": _bitwise("|", operator.or_),
    "^": _bitwise("^", operator.xor),
    "&": _bitwise("&", operator.and_),
    "&&": _logical(lambda left, right: left and right),
    "||": _logical(lambda left, right: left or right),
}

_TEXT_RELATIONS: Final[Mapping[str, Relation]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
_NUMBER_RELATIONS: Final[Mapping[str, Relation]] = {
    **_TEXT_RELATIONS,
    "==": lambda left, right: abs(left - right) <= TOLERANCE,
    "!=": lambda left, right: not abs(left - right) <= TOLERANCE,
}


@dataclass(frozen=True, slots=True)
class Function:
    """A function of our extension; ``arguments`` are the fewest and the most values that it takes."""

    calculate: Callable[[Sequence[float]], float]
    arguments: tuple[int, int]

    def __call__(self, name: str, values: Sequence[Any]) -> float:
        """Return the result as a real; raises ScriptError for what is no number."""
        return self.calculate([float(_number(name, value)) for value in values])


FUNCTIONS: Final[Mapping[str, Function]] = {
    "abs": Function(lambda values: abs(values[0]), (1, 1)),
    "min": Function(min, (2, MAX_VALUES)),
    "max": Function(max, (2, MAX_VALUES)),
}


def relation(symbol: str, enums: Mapping[str, int]) -> Relation:
    """Return what a comparison operator means.

    Text compared with a number is read as a number or as the name of one.
    """
    of_numbers, of_texts = _NUMBER_RELATIONS[symbol], _TEXT_RELATIONS[symbol]

    def compare(left: Any, right: Any) -> bool:
        if isinstance(left, int | float):
            if isinstance(right, int | float):
                return of_numbers(left, right)
            if isinstance(right, str):
                return of_numbers(left, number_from_text(right, enums))
        elif isinstance(left, str):
            if isinstance(right, str):
                return of_texts(left, right)
            if isinstance(right, int | float):
                return of_numbers(number_from_text(left, enums), right)
        raise ScriptError(f"'{symbol}' cannot compare {_shown(left)} with {_shown(right)}")

    return compare


def number_from_text(text: str, enums: Mapping[str, int]) -> float:
    """Return the number that a text is against a number: a truth value, an enumerated name or a real.

    Raises:
        ScriptError: It is another.
    """
    if text in TRUTH:
        return TRUTH[text]
    if text in enums:
        return float(enums[text])
    try:
        return parse_real(text)
    except ValueError as error:
        raise ScriptError(f"text where a number is needed: {error}") from None
