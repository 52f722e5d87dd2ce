"""Counts what a realization takes in the ontology: assertions in the parsed graph, and lines (paper, section IV)."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import rdflib
from rdflib.term import Literal, Node, URIRef

from regraft.adaptation_manager.planners.metacontrol.skills.generators.owl import Individuals
from regraft.adaptation_manager.planners.metacontrol.skills.model import Realization

DECLARATION = rdflib.OWL.NamedIndividual


@dataclass(frozen=True, slots=True)
class Count:
    """The assertions and lines of a realization.

    Let q be its qualities, and r the observable components that are active in it. Then 1 + q assertions are of classes,
    q of data and 1 + 2q + r of objects.
    """

    realization: Realization
    classes: int
    data: int
    objects: int
    lines: int

    @property
    def assertions(self) -> int:
        """The number of all assertions."""
        return self.classes + self.data + self.objects


def counts(made: Individuals) -> tuple[Count, ...]:
    """Return the counts of each realization, in the graph that the text means."""
    graph = rdflib.Graph()
    graph.parse(data=made.text, format="xml")
    lines = Counter(made.owners)
    return tuple(_count(graph, each, URIRef(iri), lines[iri]) for each, iri in made.designs)


def _count(graph: rdflib.Graph, realization: Realization, design: URIRef, lines: int) -> Count:
    """Count what is stated of a design, of the values that it alone has, and of components that it requires."""
    own: list[Node] = [design, *_values(graph, design)]
    stated = [(predicate, value) for subject in own for predicate, value in graph.predicate_objects(subject)]
    classes = [value for predicate, value in stated if predicate == rdflib.RDF.type and value != DECLARATION]
    data = [value for _, value in stated if isinstance(value, Literal)]
    about = [subject for subject in graph.subjects(None, design) if subject not in own]
    types = sum(1 for predicate, _ in stated if predicate == rdflib.RDF.type)
    return Count(realization, len(classes), len(data), len(stated) - types - len(data) + len(about), lines)


def _values(graph: rdflib.Graph, design: URIRef) -> list[Node]:
    """Return the individuals that a design points to and that have a value."""
    pointed = [value for value in graph.objects(design) if not isinstance(value, Literal)]
    return [each for each in pointed if any(isinstance(value, Literal) for value in graph.objects(each))]
