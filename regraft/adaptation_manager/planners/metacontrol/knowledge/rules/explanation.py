"""Why a fact holds: the tree of rules and facts that led to it, as data and as text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import Atom, Builtin, Identity
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.chainer import Conclusions, Derivation
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Fact, Term, Var, fact_text, text_of
from regraft.bus_schema.annotations import PlainValue

MAX_DEPTH: Final = 100

SIGNS: Final = {
    "equal": "=",
    "notEqual": "≠",
    "lessThan": "<",
    "lessThanOrEqual": "≤",
    "greaterThan": ">",
    "greaterThanOrEqual": "≥",
}
OPERATIONS: Final = {"add": " + ", "subtract": " - ", "multiply": " * "}


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a fact holds. ``rule`` is empty where the fact was given; ``checks`` are the tests that it passed.

    A fact that the tree has shown before is ``repeated``: its premises are not shown again.
    """

    fact: Fact
    rule: str
    file: str
    premises: tuple[Reason, ...]
    checks: tuple[str, ...]
    repeated: bool

    def lines(self, indent: int = 0) -> Iterator[str]:
        """Yield the tree as lines of text, premises below their conclusion."""
        source = f"by {self.rule}" if self.rule else "given"
        where = f" ({self.file})" if self.file else ""
        more = ", as above" if self.repeated and self.rule else ""
        yield f"{'  ' * indent}{fact_text(self.fact)}: {source}{where}{more}"
        for check in self.checks:
            yield f"{'  ' * (indent + 1)}{check}"
        for premise in self.premises:
            yield from premise.lines(indent + 1)

    def text(self) -> str:
        """Return the tree as text."""
        return "\n".join(self.lines())

    def as_data(self) -> dict[str, PlainValue]:
        """Return the tree as plain data."""
        found: dict[str, PlainValue] = {"fact": fact_text(self.fact), "rule": self.rule or None}
        if self.file:
            found["file"] = self.file
        if self.repeated:
            found["repeated"] = True
        if self.checks:
            found["checks"] = list(self.checks)
        if self.premises:
            found["premises"] = [premise.as_data() for premise in self.premises]
        return found


def explain(conclusions: Conclusions, fact: Fact) -> Reason | None:
    """Return why a fact holds, None if it does not."""
    return _reason(conclusions, fact, set(), 0) if fact in conclusions else None


def _reason(conclusions: Conclusions, fact: Fact, shown: set[Fact], depth: int) -> Reason:
    derivation = conclusions.derivation(fact)
    if derivation is None:
        return Reason(fact, "", "", (), (), False)
    rule = derivation.rule
    if fact in shown or depth >= MAX_DEPTH:
        return Reason(fact, rule.name, rule.file, (), (), True)
    shown.add(fact)
    premises = tuple(_reason(conclusions, premise, shown, depth + 1) for premise in derivation.premises())
    return Reason(fact, rule.name, rule.file, premises, tuple(_checks(derivation)), False)


def _checks(derivation: Derivation) -> Iterator[str]:
    values = derivation.value_of()
    for atom in derivation.rule.body:
        if isinstance(atom, Atom):
            continue
        terms: list[Term] = [values[each] if isinstance(each, Var) else each for each in atom.arguments]
        yield _check_text(atom, [text_of(term) for term in terms])


def _check_text(atom: Builtin | Identity, terms: list[str]) -> str:
    if isinstance(atom, Identity):
        return f"{terms[0]} {'is' if atom.same else 'is not'} {terms[1]}"
    if atom.name in SIGNS:
        return f"{terms[0]} {SIGNS[atom.name]} {terms[1]}"
    return f"{terms[0]} = {OPERATIONS[atom.name].join(terms[1:])}"
