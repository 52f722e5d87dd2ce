"""The axioms of OWL that the knowledge base obeys, as rules, and as what contradicts.

Subclasses, subproperties, domains, ranges, and inverse, symmetric and transitive properties become rules. Functional
properties and disjoint classes are what facts may contradict. Class expressions are ignored. OWL 2 Web Ontology
Language, Mapping to RDF Graphs (second edition, W3C recommendation of 11 December 2012).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from rdflib import OWL, RDF, RDFS, Graph, URIRef
from rdflib.term import Node

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import Atom, Rule
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Var, local_name

X, Y, Z = Var("x"), Var("y"), Var("z")
MAX_MEMBERS: Final = 1000
BUILT_IN: Final = (str(OWL), str(RDF), str(RDFS), "http://www.w3.org/2001/XMLSchema#")


@dataclass(frozen=True, slots=True)
class Axioms:
    """Axioms as rules, the properties with one value, and groups of classes that share no individual."""

    rules: tuple[Rule, ...]
    functional: frozenset[str]
    disjoint: tuple[frozenset[str], ...]


def read_axioms(graphs: Iterable[Graph]) -> Axioms:
    """Return the axioms of several files together."""
    rules: dict[Rule, None] = {}
    functional: set[str] = set()
    disjoint: set[frozenset[str]] = set()
    for graph in graphs:
        rules.update(dict.fromkeys(_rules(graph)))
        functional |= {str(node) for node in graph.subjects(RDF.type, OWL.FunctionalProperty)}
        disjoint |= set(_disjoint(graph))
    ordered = sorted(rules, key=lambda rule: rule.name)
    return Axioms(tuple(ordered), frozenset(functional), tuple(sorted(disjoint, key=sorted)))


def relevant_axioms(axioms: Axioms, rules: Iterable[Rule]) -> tuple[Rule, ...]:
    """Return the axioms' rules from whose conclusions other rules may conclude something."""
    needed = {atom.predicate for rule in rules for atom in rule.body if isinstance(atom, Atom)}
    left, found = list(axioms.rules), list[Rule]()
    while ready := [rule for rule in left if any(atom.predicate in needed for atom in rule.head)]:
        found += ready
        left = [rule for rule in left if rule not in ready]
        needed |= {atom.predicate for rule in ready for atom in rule.body if isinstance(atom, Atom)}
    return tuple(sorted(found, key=lambda rule: rule.name))


def _named(pairs: Iterable[tuple[Node, Node]]) -> Iterator[tuple[str, str]]:
    for one, other in pairs:
        names = str(one), str(other)
        named = isinstance(one, URIRef) and isinstance(other, URIRef) and one != other
        if named and not any(name.startswith(BUILT_IN) for name in names):
            yield names


def _rules(graph: Graph) -> Iterator[Rule]:
    for part, whole in _named(graph.subject_objects(RDFS.subClassOf)):
        yield _rule(f"subclass {local_name(part)}", Atom(part, (X,)), Atom(whole, (X,)))
    for one, other in _named(graph.subject_objects(OWL.equivalentClass)):
        yield _rule(f"equivalent {local_name(one)}", Atom(one, (X,)), Atom(other, (X,)))
        yield _rule(f"equivalent {local_name(other)}", Atom(other, (X,)), Atom(one, (X,)))
    for part, whole in _named(graph.subject_objects(RDFS.subPropertyOf)):
        yield _rule(f"subproperty {local_name(part)}", Atom(part, (X, Y)), Atom(whole, (X, Y)))
    for name, kind in _named(graph.subject_objects(RDFS.domain)):
        yield _rule(f"domain of {local_name(name)}", Atom(name, (X, Y)), Atom(kind, (X,)))
    for name, kind in _named(graph.subject_objects(RDFS.range)):
        yield _rule(f"range of {local_name(name)}", Atom(name, (X, Y)), Atom(kind, (Y,)))
    for one, other in _named(graph.subject_objects(OWL.inverseOf)):
        yield _rule(f"inverse of {local_name(one)}", Atom(one, (X, Y)), Atom(other, (Y, X)))
        yield _rule(f"inverse of {local_name(other)}", Atom(other, (X, Y)), Atom(one, (Y, X)))
    for node in graph.subjects(RDF.type, OWL.SymmetricProperty):
        name = str(node)
        yield _rule(f"symmetric {local_name(name)}", Atom(name, (X, Y)), Atom(name, (Y, X)))
    for node in graph.subjects(RDF.type, OWL.TransitiveProperty):
        name = str(node)
        body = (Atom(name, (X, Y)), Atom(name, (Y, Z)))
        yield Rule(f"transitive {local_name(name)}", body, (Atom(name, (X, Z)),))


def _rule(name: str, body: Atom, head: Atom) -> Rule:
    return Rule(name, (body,), (head,))


def _disjoint(graph: Graph) -> Iterator[frozenset[str]]:
    for one, other in _named(graph.subject_objects(OWL.disjointWith)):
        yield frozenset((one, other))
    for node in graph.subjects(RDF.type, OWL.AllDisjointClasses):
        for start in graph.objects(node, OWL.members):
            yield frozenset(str(item) for item in _items(graph, start) if isinstance(item, URIRef))


def _items(graph: Graph, start: Node) -> Iterator[Node]:
    """Yield a list's items; a list without an end is cut."""
    current: Node | None = start
    for _ in range(MAX_MEMBERS):
        if current is None or current == RDF.nil:
            return
        item = graph.value(current, RDF.first)
        if item is not None:
            yield item
        current = graph.value(current, RDF.rest)
