"""Terms and facts: individuals, data values, variables, and tuples of a predicate and its arguments."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeAlias

NUMBER: Final = "number"
TEXT: Final = "text"
TRUTH: Final = "truth"


class Data(NamedTuple):
    """A data value; ``kind`` is ``number``, ``text``, ``truth`` or the IRI of another datatype.

    The kind keeps the number 1, the text "1" and the truth value true apart. Numbers are floats of any XML datatype.
    """

    kind: str
    value: float | str | bool


Term: TypeAlias = str | Data
"""A thing that a fact is about: an individual, by its IRI, or a data value."""

Fact: TypeAlias = tuple[str, Term] | tuple[str, Term, Term]
"""A predicate and its arguments: a class has one, a property has two."""


@dataclass(frozen=True, slots=True)
class Var:
    """A variable of one rule."""

    name: str


Argument: TypeAlias = str | Data | Var


def number(value: float) -> Data:
    """Return a number as a term; raises ValueError unless it is finite."""
    if not math.isfinite(value):
        raise ValueError(f"the number is {value}, must be finite")
    return Data(NUMBER, float(value) + 0.0)  # adding zero turns -0.0, which equals 0.0, into it


def text(value: str) -> Data:
    """Return a text as a term."""
    return Data(TEXT, value)


def truth(value: bool) -> Data:
    """Return a truth value as a term."""
    return Data(TRUTH, value)


def local_name(iri: str) -> str:
    """Return the part of an IRI that people read.

    >>> local_name("http://ros/mros#requiredBy")
    'requiredBy'
    """
    name = iri.rsplit("#", 1)[-1] if "#" in iri else iri.rstrip("/").rsplit("/", 1)[-1]
    return name or iri


def text_of(argument: Argument) -> str:
    """Return an argument as people read it."""
    if isinstance(argument, Var):
        return f"?{local_name(argument.name)}"
    if isinstance(argument, str):
        return local_name(argument)
    if argument.kind == TRUTH:
        return "true" if argument.value else "false"
    return f"{argument.value:g}" if argument.kind == NUMBER else f'"{argument.value}"'


def fact_text(fact: Fact) -> str:
    """Return a fact as people read it.

    >>> fact_text(("http://t#c_status", "http://x#laser", text("FALSE")))
    'c_status(laser, "FALSE")'
    """
    return f"{local_name(fact[0])}({', '.join(text_of(argument) for argument in fact[1:])})"


def order_of(fact: Fact) -> tuple[str, ...]:
    """Return a key that sorts facts, whichever kinds of terms they hold."""
    return (
        fact[0],
        *(term if isinstance(term, str) else f"\x00{term.kind}\x00{term.value!r}" for term in fact[1:]),
    )
