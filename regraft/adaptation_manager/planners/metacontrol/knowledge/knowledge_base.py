"""Loads a knowledge base from its files: facts, rules and axioms of all levels, checked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rdflib import OWL, RDF, Graph
from rdflib.term import Node

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError, Problem
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.assertions import read_facts
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.axioms import Axioms, read_axioms
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.documents import Document
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.imports import ONTOLOGIES, read_all
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.literals import add_fact
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.swrl import declared_variables, read_rules
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import Rule
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.chainer import (
    Base,
    Conclusions,
    Program,
    TooManyFacts,
)
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.conflicts import Conflict, conflicts
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Fact

LEVELS = (ONTOLOGIES / "tomasys.owl", ONTOLOGIES / "mros.owl", ONTOLOGIES / "navigation.owl")
"""The two upper levels of a knowledge base for navigation; the file of an application's individuals follows."""


@dataclass(frozen=True, slots=True)
class KnowledgeBase:
    """The content of the files, and all that follows from it.

    ``facts`` are in the one vocabulary of statuses. ``axioms`` are what conclusions must obey.
    """

    documents: tuple[Document, ...]
    facts: tuple[Fact, ...]
    rules: tuple[Rule, ...]
    axioms: Axioms
    base: Base
    _order: dict[str, tuple[int, int]] = field(repr=False)

    @property
    def files(self) -> tuple[str, ...]:
        """Return the names of the files, those that were given first."""
        return tuple(document.file for document in self.documents)

    def place(self, individual: str) -> tuple[str, int]:
        """Return the file and the line where an individual is described first; line 0 where none does."""
        number, _ = self._order.get(individual, (0, 0))
        return self.documents[number].place(individual)

    def order(self, individual: str) -> tuple[int, int, str]:
        """Return a key that sorts individuals as their files have them."""
        return (*self._order.get(individual, (len(self.documents), 0)), individual)

    def conclude(self, facts: Iterable[Fact] = ()) -> Conclusions:
        """Return what follows from the files and from some more facts; raises TooManyFacts."""
        return self.base.conclude(facts)

    def conflicts(self, conclusions: Conclusions) -> tuple[Conflict, ...]:
        """Return the conclusions that contradict each other."""
        return conflicts(conclusions, self.axioms.functional, self.axioms.disjoint)


def load(files: Sequence[Path | str]) -> KnowledgeBase:
    """Return the knowledge base that files hold; raises KnowledgeError with all that is wrong with them.

    Later files become imports of the first. An imported file must be among the files, or be one that is shipped.
    """
    return base_of(read_all([Path(file) for file in files]))


def base_of(documents: Sequence[Document]) -> KnowledgeBase:
    """Return the knowledge base that documents hold, all imports among them; raises KnowledgeError."""
    graphs = [document.graph for document in documents]
    annotations: frozenset[Node] = frozenset(
        node for graph in graphs for node in graph.subjects(RDF.type, OWL.AnnotationProperty)
    )
    variables = frozenset(node for graph in graphs for node in declared_variables(graph))
    facts: dict[Fact, None] = {}
    rules: dict[Rule, None] = {}
    sources: dict[Fact, Document] = {}
    problems: list[Problem] = []
    for document in documents:
        found, wrong = read_facts(document, annotations)
        problems += wrong
        facts.update(dict.fromkeys(found))
        for fact in found:
            sources.setdefault(fact, document)
        read, wrong = read_rules(document, variables)
        problems += wrong
        for rule in read:
            rules.setdefault(rule)  # files repeat the rules of those that they import
    if problems:
        raise KnowledgeError(sorted(problems))
    axioms = read_axioms(graphs)
    base = _closure((*axioms.rules, *rules), facts, documents)
    _check_consistency(base.conclude(), axioms, sources)
    order = _order_of(documents)
    return KnowledgeBase(tuple(documents), tuple(facts), tuple(rules), axioms, base, order)


def _closure(rules: Iterable[Rule], facts: Iterable[Fact], documents: Sequence[Document]) -> Base:
    try:
        return Program(rules).over(facts)
    except TooManyFacts as error:
        file = error.file or documents[0].file
        raise KnowledgeError([Problem(file, 0, f"rule {error.rule!r}: {error.why}")]) from None


def _check_consistency(conclusions: Conclusions, axioms: Axioms, sources: dict[Fact, Document]) -> None:
    """Raise KnowledgeError for facts that contradict each other by axioms alone; rules may conclude what they will."""
    own = set(axioms.rules)
    problems: list[Problem] = []
    for conflict in conflicts(conclusions, axioms.functional, axioms.disjoint):
        given = [_given(conclusions, fact, own) for fact in conflict.facts]
        if all(given):
            subject = str(conflict.subject)
            files = {sources[each].place(subject)[0] for each in given if each is not None}
            # The last file adds to those before it: the contradiction is there to be removed.
            first = next(sources[fact] for fact in reversed(given) if fact is not None)
            file, line = first.place(subject)
            others = sorted(files - {file})
            where = f" (with {', '.join(others)})" if others else ""
            problems.append(Problem(file, line, f"{conflict.text(conclusions)}{where}"))
    if problems:
        raise KnowledgeError(sorted(problems))


def _given(conclusions: Conclusions, fact: Fact, axioms: set[Rule]) -> Fact | None:
    """Return the stated fact from which axioms alone lead to a fact, None where other rules have a part."""
    current = fact
    while (derivation := conclusions.derivation(current)) is not None:
        if derivation.rule not in axioms:
            return None
        current = derivation.premises()[0]
    return current


def _order_of(documents: Sequence[Document]) -> dict[str, tuple[int, int]]:
    found: dict[str, tuple[int, int]] = {}
    for number, document in enumerate(documents):
        for iri, line in document.places.subjects.items():
            found.setdefault(iri, (number, line))
    return found


def snapshot(knowledge: KnowledgeBase, facts: Iterable[Fact] = ()) -> Graph:
    """Return all files and some more facts as one graph, which imports nothing."""
    graph = Graph()
    first = knowledge.documents[0]
    headers = {node for document in knowledge.documents for node in document.graph.subjects(RDF.type, OWL.Ontology)}
    own = set(first.graph.subjects(RDF.type, OWL.Ontology))
    for document in knowledge.documents:
        for subject, predicate, value in document.graph:
            if subject in headers and (subject not in own or predicate == OWL.imports):
                continue
            graph.add((subject, predicate, value))
    for fact in facts:
        add_fact(graph, fact)
    return graph
