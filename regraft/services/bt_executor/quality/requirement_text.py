"""Requirements as data, and as people write them: ``{@nearest} at least 0.46 or {@speed} at most 0.18``.

    requirement = part { "or" part }                    the degree of the better one
    part        = comparison { "and" comparison }       the degree of the worse one
    comparison  = [ "not" ] ( "(" requirement ")" | [ operand ] relation operand [ "within" operand ] )
    operand     = a number, or {key} of a blackboard entry; without one in front, the metric is meant

The relations are those of `RELATIONS`. "or", "and" and "not" are those of fuzzy logic: maximum, minimum, 1 - degree.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from behavior_tree.data.values import parse_real
from behavior_tree.nodes.text import board_key
from regraft.services.bt_executor.quality.satisfaction_degree import RELATIONS, Relation

DEEPEST: Final = 20
"""Levels of brackets and negations in a requirement."""

MAX_SHOWN_LENGTH: Final = 200
_TOKEN: Final = re.compile(r"\s*(\{[^{}]*\}|[()]|[^\s(){}]+)")
_LEADING_WORDS: Final = sorted(RELATIONS, key=lambda relation: -len(relation.words.split()))


@dataclass(frozen=True, slots=True)
class Key:
    """The blackboard entry whose value is meant."""

    key: str


Operand = float | Key
Values = Callable[[Key | None], float]
"""Gives the number that an entry holds; for None, the metric."""


def operand(text: str) -> Operand:
    """Return what a text such as ``0.18`` or ``{@limit}`` represents; raises ValueError if it is neither."""
    key = board_key(text, "")
    if key:
        return Key(key)
    try:
        return parse_real(text)
    except ValueError:
        raise ValueError(f"'{text}' is neither a number nor a blackboard key as in {{key}}") from None


def _value(of: Operand, values: Values) -> float:
    return values(of) if isinstance(of, Key) else of


@dataclass(frozen=True, slots=True)
class Comparison:
    """A number that a relation must hold for; without ``subject``, the metric."""

    subject: Operand | None
    relation: Relation
    bound: Operand
    within: Operand | None = None

    def __post_init__(self) -> None:
        """Check what is known already; raises ValueError."""
        if self.within is None and self.relation.needs_within:
            raise ValueError(f"'{self.relation.words}' needs 'within': how far away is still good enough")
        if isinstance(self.bound, float) and not isinstance(self.within, Key):
            self.relation.holds_to(0.0, self.bound, self.within)

    def degree(self, values: Values) -> float:
        """Return the degree in [0, 1] to which it holds; raises ValueError for an impossible tolerance."""
        subject = values(None) if self.subject is None else _value(self.subject, values)
        within = None if self.within is None else _value(self.within, values)
        return self.relation.holds_to(subject, _value(self.bound, values), within)

    def subjects(self) -> Iterator[Key]:
        """Give the entries that are required to be something."""
        if isinstance(self.subject, Key):
            yield self.subject


@dataclass(frozen=True, slots=True)
class AllOf:
    """Several requirements at once; holds as far as the least of them."""

    parts: tuple[Requirement, ...]

    def degree(self, values: Values) -> float:
        """Return the least degree."""
        return min([part.degree(values) for part in self.parts])

    def subjects(self) -> Iterator[Key]:
        """Give the entries that are required to be something."""
        for part in self.parts:
            yield from part.subjects()


@dataclass(frozen=True, slots=True)
class AnyOf:
    """One of several requirements; holds as far as the best of them."""

    parts: tuple[Requirement, ...]

    def degree(self, values: Values) -> float:
        """Return the greatest degree."""
        return max([part.degree(values) for part in self.parts])

    def subjects(self) -> Iterator[Key]:
        """Give the entries that are required to be something."""
        for part in self.parts:
            yield from part.subjects()


@dataclass(frozen=True, slots=True)
class Not:
    """The opposite of a requirement."""

    part: Requirement

    def degree(self, values: Values) -> float:
        """Return what is missing to 1."""
        return 1.0 - self.part.degree(values)

    def subjects(self) -> Iterator[Key]:
        """Give the entries that are required to be something."""
        return self.part.subjects()


Requirement = Comparison | AllOf | AnyOf | Not


def parse_requirement(text: str) -> Requirement:
    """Read a requirement; raises ValueError, which states what is wrong where."""
    return _Parser(text).whole()


def _without_blanks(text: str) -> str:
    return re.sub(r"\s", "", text)


class _Parser:
    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = _TOKEN.findall(text)
        self._depth = 0
        if _without_blanks("".join(self._tokens)) != _without_blanks(text):
            raise self._wrong("a brace is missing, or one is too many")

    def whole(self) -> Requirement:
        requirement = self._any_of()
        if self._tokens:
            raise self._wrong(f"'{self._tokens[0]}' is not understood here")
        return requirement

    def _any_of(self) -> Requirement:
        parts = [self._all_of()]
        while self._take("or"):
            parts.append(self._all_of())
        return parts[0] if len(parts) == 1 else AnyOf(tuple(parts))

    def _all_of(self) -> Requirement:
        parts = [self._wish()]
        while self._take("and"):
            parts.append(self._wish())
        return parts[0] if len(parts) == 1 else AllOf(tuple(parts))

    def _wish(self) -> Requirement:
        if self._take("not"):
            return Not(self._nested(self._wish))
        if self._take("("):
            inner = self._nested(self._any_of)
            if not self._take(")"):
                raise self._wrong("a ')' is missing")
            return inner
        subject = None if self._relation_ahead() else self._operand("a number, a {key} or a relation")
        relation = self._relation_ahead()
        if relation is None:
            known = ", ".join(f"'{each.words}'" for each in RELATIONS)
            raise self._wrong(f"a relation is missing: one of {known}")
        del self._tokens[: len(relation.words.split())]
        bound = self._operand(f"a number behind '{relation.words}'")
        within = self._operand("a number behind 'within'") if self._take("within") else None
        return Comparison(subject, relation, bound, within)

    def _nested(self, read: Callable[[], Requirement]) -> Requirement:
        self._depth += 1
        if self._depth > DEEPEST:
            raise self._wrong(f"it is nested more than {DEEPEST} levels deep")
        inner = read()
        self._depth -= 1
        return inner

    def _relation_ahead(self) -> Relation | None:
        for relation in _LEADING_WORDS:
            words = relation.words.split()
            if self._tokens[: len(words)] == words:
                return relation
        return None

    def _operand(self, wanted: str) -> Operand:
        if not self._tokens:
            raise self._wrong(f"it ends where {wanted} should be")
        token = self._tokens[0]
        try:
            found = operand(token)
        except ValueError:
            raise self._wrong(f"{wanted} should be where '{token}' is") from None
        del self._tokens[0]
        return found

    def _take(self, token: str) -> bool:
        if self._tokens and self._tokens[0] == token:
            del self._tokens[0]
            return True
        return False

    def _wrong(self, why: str) -> ValueError:
        text = self._text if len(self._text) <= MAX_SHOWN_LENGTH else f"{self._text[:MAX_SHOWN_LENGTH]}…"
        return ValueError(f"requirement '{text}': {why}")
