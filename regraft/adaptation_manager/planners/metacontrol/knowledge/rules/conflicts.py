"""Conclusions that contradict each other: two values of a property that may have one, or two disjoint classes."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.chainer import Conclusions
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import (
    Fact,
    Term,
    fact_text,
    local_name,
    text_of,
)


@dataclass(frozen=True, slots=True)
class Conflict:
    """Facts about one individual that cannot all hold, and why they cannot."""

    subject: Term
    facts: tuple[Fact, ...]
    why: str

    def text(self, conclusions: Conclusions) -> str:
        """Return the conflict, with the rule or the file's statement behind each fact."""
        return f"{text_of(self.subject)}: {self.why}: {'; '.join(_source(conclusions, fact) for fact in self.facts)}"


def _source(conclusions: Conclusions, fact: Fact) -> str:
    derivation = conclusions.derivation(fact)
    return f"{fact_text(fact)} {'given' if derivation is None else f'by {derivation.rule.name}'}"


def conflicts(
    conclusions: Conclusions, functional: Iterable[str], disjoint: Iterable[Collection[str]] = ()
) -> tuple[Conflict, ...]:
    """Return all conflicts: ``functional`` are properties with one value, ``disjoint`` groups of classes."""
    found: list[Conflict] = []
    for predicate in sorted(set(functional)):
        values = _by_subject(conclusions.of(predicate))
        why = f"{local_name(predicate)} has one value at most"
        found += [Conflict(subject, tuple(facts), why) for subject, facts in values.items() if len(facts) > 1]
    for group in disjoint:
        members = [fact for name in sorted(group) for fact in conclusions.of(name)]
        by_subject = _by_subject(members)
        found += [
            Conflict(subject, tuple(facts), "the classes are disjoint")
            for subject, facts in by_subject.items()
            if len(facts) > 1
        ]
    return tuple(found)


def _by_subject(facts: Iterable[Fact]) -> dict[Term, list[Fact]]:
    found: dict[Term, list[Fact]] = {}
    for fact in facts:
        found.setdefault(fact[1], []).append(fact)
    return found
