"""Conclusions that contradict each other: two values of a property that may have one, or two disjoint classes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
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
        found += _several(_by_subject(conclusions.of(predicate)), _one_value(predicate))
    for group in disjoint:
        members = [fact for name in sorted(group) for fact in conclusions.of(name)]
        found += _several(_by_subject(members), "the classes are disjoint")
    return tuple(found)


def added_conflicts(conclusions: Conclusions, functional: Iterable[str]) -> tuple[Conflict, ...]:
    """Return the conflicts in which facts have a part that the base does not have; fast where those are few."""
    found: list[Conflict] = []
    for predicate in sorted(set(functional)):
        added = _by_subject(conclusions.added(predicate))
        whole = {subject: [*conclusions.origin.about(predicate, subject), *facts] for subject, facts in added.items()}
        found += _several(whole, _one_value(predicate))
    return tuple(found)


def _one_value(predicate: str) -> str:
    return f"{local_name(predicate)} has one value at most"


def _several(by_subject: Mapping[Term, list[Fact]], why: str) -> Iterator[Conflict]:
    return (Conflict(subject, tuple(facts), why) for subject, facts in by_subject.items() if len(facts) > 1)


def _by_subject(facts: Iterable[Fact]) -> dict[Term, list[Fact]]:
    found: dict[Term, list[Fact]] = {}
    for fact in facts:
        found.setdefault(fact[1], []).append(fact)
    return found
