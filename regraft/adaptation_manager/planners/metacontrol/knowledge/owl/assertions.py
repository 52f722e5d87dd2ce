"""The assertions of a file: which of its triples are facts about individuals, in the one vocabulary."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from rdflib import OWL, RDF, RDFS, BNode, Graph, Literal, URIRef
from rdflib.term import Node

from regraft.adaptation_manager.planners.metacontrol.knowledge import vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import Problem
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.documents import Document
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.literals import term_of
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Fact, local_name, text
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import OPERATORS, normalized

NO_FACTS: Final = (
    str(OWL),
    str(RDF),
    str(RDFS),
    "http://www.w3.org/2003/11/swrl#",
    "http://www.w3.org/2003/11/swrlb#",
    "http://swrl.stanford.edu/",
)
"""The namespaces of OWL and SWRL themselves: what they state is no fact about an individual."""
TYPE, SAME_AS = RDF.type, OWL.sameAs


def read_facts(document: Document, annotations: frozenset[Node]) -> tuple[list[Fact], list[Problem]]:
    """Return the facts of a file, and what is wrong with them; ``annotations`` are properties that state none."""
    facts: list[Fact] = []
    problems: list[Problem] = []
    for subject, predicate, value in document.graph:
        if predicate in annotations or not _is_fact(document.graph, subject, predicate, value):
            continue
        why = ""
        if isinstance(subject, BNode) or isinstance(value, BNode):
            why = f"{local_name(str(predicate))} is stated of an individual without an IRI; give it one"
        elif predicate == SAME_AS:
            why = f"is the same as {local_name(str(value))!r}; names are unique here: use one of both"
        else:
            try:
                facts += _facts(str(subject), str(predicate), value)
            except ValueError as error:
                why = str(error)
        if why:
            name = "" if isinstance(subject, BNode) else f"{local_name(str(subject))!r}: "
            problems.append(Problem(*document.place(str(subject)), f"{name}{why}"))
    return facts, problems


def _is_fact(graph: Graph, subject: Node, predicate: Node, value: Node) -> bool:
    if predicate == SAME_AS:
        return subject != value
    if predicate == TYPE:
        return isinstance(value, URIRef) and not str(value).startswith(NO_FACTS)
    return not str(predicate).startswith(NO_FACTS)


def _facts(subject: str, predicate: str, node: Node) -> Iterator[Fact]:
    if predicate == vocabulary.RDF_TYPE:
        yield (str(node), subject)
        return
    predicate, value = normalized(predicate, term_of(node))
    yield (predicate, subject, value)
    if predicate == vocabulary.COMPARISON_OPERATOR and isinstance(node, Literal):
        yield (vocabulary.DIRECTION, subject, text(OPERATORS[value]))
