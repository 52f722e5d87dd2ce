"""Reads SWRL rules from RDF (W3C member submission of 21 May 2004, section 6).

Understood are atoms of named classes, of properties, of identity, and of the built-ins that the rule engine has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from rdflib import OWL, RDF, RDFS, BNode, Graph, Literal, Namespace, URIRef
from rdflib.term import Node

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import Problem
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.documents import Document
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.literals import term_of
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import (
    Atom,
    BodyAtom,
    Builtin,
    Identity,
    Rule,
    RuleError,
    rule_text,
)
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.checking import MAX_ATOMS, check_rule
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Argument, Data, Var, local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import normalized
from regraft.bus_schema.suggestions import instead_of

SWRL: Final = Namespace("http://www.w3.org/2003/11/swrl#")
SWRLB: Final = "http://www.w3.org/2003/11/swrlb#"
ENABLED: Final = URIRef("http://swrl.stanford.edu/ontologies/3.3/swrla.owl#isRuleEnabled")
MAX_RULES: Final = 2000

ATOM_CLASSES: Final = (
    "ClassAtom",
    "IndividualPropertyAtom",
    "DatavaluedPropertyAtom",
    "SameIndividualAtom",
    "DifferentIndividualsAtom",
    "BuiltinAtom",
)


class _Malformed(ValueError):
    """An atom or a list that is not as SWRL has it."""


def read_rules(document: Document, variables: frozenset[Node]) -> tuple[list[Rule], list[Problem]]:
    """Return the rules of a file, and what is wrong with those that have no meaning.

    ``variables`` are those of all files: some files use variables that another declares.
    """
    rules: list[Rule] = []
    problems: list[Problem] = []
    nodes = list(document.graph.subjects(RDF.type, SWRL.Imp))
    if len(nodes) > MAX_RULES:
        return [], [Problem(document.file, 0, f"has {len(nodes)} rules, must have at most {MAX_RULES}")]
    for node in nodes:
        if _is_disabled(document.graph, node):
            continue
        name = _name_of(document.graph, node)
        line = document.places.labels.get(name, document.places.line(str(node)))
        try:
            rule = _Reader(document, name, variables).rule(node)
            check_rule(rule)
        except _Malformed as error:
            problems.append(Problem(document.file, line, f"rule {name!r}: {error}"))
        except RuleError as error:
            problems.append(Problem(document.file, line, f"rule {error.rule!r}: {error.why}"))
        else:
            rules.append(rule)
    return sorted(rules, key=lambda rule: (rule.name, rule_text(rule))), problems


def declared_variables(graph: Graph) -> set[Node]:
    """Return the variables that a file declares."""
    return set(graph.subjects(RDF.type, SWRL.Variable))


def _is_disabled(graph: Graph, node: Node) -> bool:
    value = graph.value(node, ENABLED)
    return isinstance(value, Literal) and value.toPython() is False


def _name_of(graph: Graph, node: Node) -> str:
    labels = sorted(str(label).strip() for label in graph.objects(node, RDFS.label))
    if labels:
        return labels[0]
    return local_name(str(node)) if isinstance(node, URIRef) else "(without a label)"


class _Reader:
    """Reads one rule of a file."""

    def __init__(self, document: Document, name: str, variables: frozenset[Node]) -> None:
        self._document = document
        self._graph = document.graph
        self._name = name
        self._variables = variables

    def rule(self, node: Node) -> Rule:
        comment = sorted(str(text) for text in self._graph.objects(node, RDFS.comment))
        body = tuple(self._atoms(node, SWRL.body))
        head: list[Atom] = []
        for atom in self._atoms(node, SWRL.head):
            if not isinstance(atom, Atom):
                what = "a built-in" if isinstance(atom, Builtin) else "identity, since names are unique here"
                raise _Malformed(f"the head has {what}, must have classes and properties alone")
            head.append(atom)
        name = self._name
        return Rule(name, body, tuple(head), self._document.file, comment[0] if comment else "")

    def _atoms(self, node: Node, part: URIRef) -> Iterator[BodyAtom]:
        start = self._only(node, part, f"its {local_name(str(part))}")
        for item in self._items(start, f"its {local_name(str(part))}"):
            yield self._atom(item)

    def _items(self, start: Node, what: str) -> Iterator[Node]:
        """Yield the items of a list; raises _Malformed for one that has no end."""
        current, count = start, 0
        while current != RDF.nil:
            count += 1
            if count > MAX_ATOMS:
                raise _Malformed(f"{what} is a list of more than {MAX_ATOMS} items, or one without an end")
            yield self._only(current, RDF.first, f"an item of {what}")
            current = self._only(current, RDF.rest, f"the rest of {what}")

    def _only(self, node: Node, predicate: URIRef, what: str) -> Node:
        found = list(self._graph.objects(node, predicate))
        if len(found) != 1:
            short = local_name(str(predicate))
            raise _Malformed(f"{what} has {len(found)} values of {short!r}, must have 1")
        return found[0]

    def _atom(self, node: Node) -> BodyAtom:
        types = {str(kind) for kind in self._graph.objects(node, RDF.type)}
        found = [name for name in ATOM_CLASSES if str(SWRL[name]) in types]
        if len(found) != 1:
            given = ", ".join(sorted(local_name(kind) for kind in types)) or "no class"
            raise _Malformed(f"an atom has {given}; {instead_of(given, ATOM_CLASSES)}")
        readers: dict[str, Callable[[Node], BodyAtom]] = {
            "ClassAtom": self._class,
            "IndividualPropertyAtom": lambda each: self._property(each, data=False),
            "DatavaluedPropertyAtom": lambda each: self._property(each, data=True),
            "SameIndividualAtom": lambda each: Identity(True, self._pair(each)),
            "DifferentIndividualsAtom": lambda each: Identity(False, self._pair(each)),
            "BuiltinAtom": self._builtin,
        }
        return readers[found[0]](node)

    def _class(self, node: Node) -> Atom:
        name = self._named(node, SWRL.classPredicate, "class")
        return Atom(name, (self._argument(node, SWRL.argument1, data=False),))

    def _property(self, node: Node, *, data: bool) -> Atom:
        name = self._named(node, SWRL.propertyPredicate, "property")
        first = self._argument(node, SWRL.argument1, data=False)
        second = self._argument(node, SWRL.argument2, data=data)
        if isinstance(second, Data):
            try:
                name, second = normalized(name, second)
            except ValueError as error:
                raise _Malformed(str(error)) from None
        return Atom(name, (first, second))

    def _pair(self, node: Node) -> tuple[Argument, Argument]:
        first = self._argument(node, SWRL.argument1, data=False)
        return first, self._argument(node, SWRL.argument2, data=False)

    def _builtin(self, node: Node) -> Builtin:
        name = self._named(node, SWRL.builtin, "built-in")
        if not name.startswith(SWRLB):
            raise _Malformed(f"there is no built-in <{name}>; those of {SWRLB} are understood")
        start = self._only(node, SWRL.arguments, f"the built-in {local_name(name)}")
        items = self._items(start, f"the arguments of {local_name(name)}")
        return Builtin(local_name(name), tuple(self._term(item) for item in items))

    def _named(self, node: Node, predicate: URIRef, what: str) -> str:
        name = self._only(node, predicate, "an atom")
        if not isinstance(name, URIRef) or name in {OWL.Thing, OWL.Nothing}:
            raise _Malformed(f"an atom's {what} is an expression, must have a name")
        return str(name)

    def _argument(self, node: Node, predicate: URIRef, *, data: bool) -> Argument:
        argument = self._term(self._only(node, predicate, "an atom"))
        if isinstance(argument, Data) and not data:
            raise _Malformed(f"an atom has the value {argument.value!r} where an individual or a variable must be")
        if isinstance(argument, str) and data:
            raise _Malformed(f"a data-valued atom has the individual <{argument}>, must have a value or a variable")
        return argument

    def _term(self, node: Node) -> Argument:
        if node in self._variables:
            return Var(str(node))
        if isinstance(node, BNode):
            raise _Malformed("an argument has no name, must be a variable, an individual or a value")
        try:
            return term_of(node)
        except ValueError as error:
            raise _Malformed(str(error)) from None
