"""Counts what a realization takes in the ontology: assertions in the parsed graph, and lines (paper, section IV)."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import rdflib
from rdflib.term import Literal, Node, URIRef

from regraft.adaptation_manager.planners.metacontrol.skills.generators.owl import OWN, Individuals
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Realization

DECLARATION = rdflib.OWL.NamedIndividual


@dataclass(frozen=True, slots=True)
class Count:
    """The assertions and lines of a realization.

    Let q be its qualities, and r the observable components that are active in it. Then 1 + q assertions are of classes,
    q of data and 1 + 2q + r of objects. ``own`` are assertions that the published files have not, counted apart: the
    context, and what is stated of required objectives.
    """

    realization: Realization
    classes: int
    data: int
    objects: int
    lines: int
    own: int

    @property
    def assertions(self) -> int:
        """The number of all assertions that the published files have."""
        return self.classes + self.data + self.objects


def counts(made: Individuals) -> tuple[Count, ...]:
    """Return the counts of each realization, in the graph that the text means."""
    graph = rdflib.Graph()
    graph.parse(data=made.text, format="xml")
    lines = Counter(made.owners)
    own = frozenset(URIRef(made.namespaces.mros + name) for name in OWN)
    return tuple(_count(graph, each, URIRef(iri), own, lines[iri]) for each, iri in made.designs)


def _count(graph: rdflib.Graph, realization: Realization, design: URIRef, own: frozenset[URIRef], lines: int) -> Count:
    """Count what is stated of a design, of the values that it alone has, and of components that it requires."""
    every = list(graph.predicate_objects(design))
    published = [each for each in every if each[0] not in own]
    values = _values(graph, [value for _, value in published])
    stated = [*published, *(each for value in values for each in graph.predicate_objects(value))]
    classes = [value for predicate, value in stated if predicate == rdflib.RDF.type and value != DECLARATION]
    data = [value for _, value in stated if isinstance(value, Literal)]
    about = [subject for subject in graph.subjects(None, design) if subject not in values]
    types = sum(1 for predicate, _ in stated if predicate == rdflib.RDF.type)
    objects = len(stated) - types - len(data) + len(about)
    further = len(every) - len(published) + _below(graph, [value for name, value in every if name in own])
    return Count(realization, len(classes), len(data), objects, lines, further)


def _values(graph: rdflib.Graph, pointed: list[Node]) -> list[Node]:
    """Return those individuals that have a value."""
    named = [value for value in pointed if not isinstance(value, Literal)]
    return [each for each in named if any(isinstance(value, Literal) for value in graph.objects(each))]


def _below(graph: rdflib.Graph, pointed: list[Node]) -> int:
    """Return how much is stated of required objectives, and of their bounds."""
    objectives = [each for each in pointed if not isinstance(each, Literal)]
    found = [each for one in objectives for each in graph.predicate_objects(one)]
    bounds = _values(graph, [value for predicate, value in found if predicate != rdflib.RDF.type])
    return len(found) + sum(1 for each in bounds for _ in graph.predicate_objects(each))
