"""The syntax tree of a script."""

from dataclasses import dataclass
from typing import TypeAlias

Expression: TypeAlias = "Literal | Name | Unary | Binary | Comparison | Conditional | Assignment | Call"


@dataclass(frozen=True, slots=True)
class Literal:
    """A number or text."""

    value: int | float | str


@dataclass(frozen=True, slots=True)
class Name:
    """The name of an enumerated number or of a blackboard entry."""

    name: str


@dataclass(frozen=True, slots=True)
class Unary:
    """An operator before its operand: ``-``, ``~`` or ``!``."""

    operator: str
    operand: Expression


@dataclass(frozen=True, slots=True)
class Binary:
    """An arithmetical, bitwise, logical or joining operator between two operands."""

    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Comparison:
    """A chain such as ``0 <= a < 3``: one operator fewer than operands."""

    operators: tuple[str, ...]
    operands: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Conditional:
    """``condition ? then : otherwise``."""

    condition: Expression
    then: Expression
    otherwise: Expression


@dataclass(frozen=True, slots=True)
class Call:
    """``abs(x)``, ``min(x, y)`` or ``max(x, y)``, of our extension."""

    function: str
    arguments: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Assignment:
    """``name := value`` and its relatives ``=``, ``+=``, ``-=``, ``*=``, ``/=``."""

    operator: str
    name: str
    value: Expression
