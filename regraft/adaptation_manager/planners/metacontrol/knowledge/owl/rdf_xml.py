"""Writes a graph as RDF/XML: the same graph gives the same bytes, in whichever order its triples are.

rdflib's own writers follow the order of a set. Blank nodes that one triple refers to are written inside it, which is
what rules and lists are; others have labels that rdflib derives from the whole graph.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from typing import Final
from xml.sax.saxutils import escape, quoteattr

from rdflib import RDF, BNode, Graph, Literal, URIRef
from rdflib.compare import to_canonical_graph
from rdflib.term import Node

PREFIXES: Final = {
    "http://www.w3.org/1999/02/22-rdf-syntax-ns#": "rdf",
    "http://www.w3.org/2000/01/rdf-schema#": "rdfs",
    "http://www.w3.org/2002/07/owl#": "owl",
    "http://www.w3.org/2003/11/swrl#": "swrl",
    "http://www.w3.org/2003/11/swrlb#": "swrlb",
    "http://swrl.stanford.edu/ontologies/3.3/swrla.owl#": "swrla",
    "http://metacontrol.org/tomasys#": "tomasys",
    "http://ros/mros#": "mros",
}
LOCAL: Final = re.compile(r"[^\W\d][\w.\-]*\Z")
FORBIDDEN: Final = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def write_rdf_xml(graph: Graph) -> bytes:
    """Return a graph as RDF/XML in UTF-8; raises ValueError where XML cannot hold a name or a text."""
    if any(count > 1 for node, count in _references(graph).items() if isinstance(node, BNode)) or _has_circle(graph):
        graph = to_canonical_graph(graph)
    return _Writer(graph).write().encode()


def _references(graph: Graph) -> Counter[Node]:
    return Counter(value for _, _, value in graph)


def _has_circle(graph: Graph) -> bool:
    """Return whether blank nodes refer to each other in a circle that no other node leads into."""
    count = _references(graph)
    reached: set[Node] = set()
    waiting = [node for node in graph.subjects() if not isinstance(node, BNode) or not count[node]]
    while waiting:
        node = waiting.pop()
        if node not in reached:
            reached.add(node)
            waiting += [value for value in graph.objects(node) if isinstance(value, BNode)]
    return any(node not in reached for node in graph.subjects())


class _Writer:
    """Writes one graph."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        count = _references(graph)
        reached_by_one: set[Node] = {node for node, times in count.items() if isinstance(node, BNode) and times == 1}
        self._inside = reached_by_one - self._in_circles(reached_by_one)
        labelled = sorted({node for node in {*graph.subjects(), *count} if isinstance(node, BNode)} - self._inside)
        self._labels: dict[Node, str] = {node: f"b{index}" for index, node in enumerate(labelled) if count[node]}
        self._prefixes = self._prefixes_of()

    def _in_circles(self, nodes: set[Node]) -> set[Node]:
        """Return those of some blank nodes that lead to themselves, each of which one triple refers to."""
        parent = {value: subject for subject, _, value in self._graph if value in nodes}
        found: set[Node] = set()
        for node in nodes:
            path, current = {node}, parent.get(node)
            while current in nodes and current not in path:
                path.add(current)
                current = parent.get(current)
            if current in path:
                found.add(node)
        return found

    def _prefixes_of(self) -> dict[str, str]:
        spaces = sorted({_split(predicate)[0] for predicate in self._graph.predicates()})
        others = [space for space in spaces if space not in PREFIXES]
        known = {space: PREFIXES[space] for space in spaces if space in PREFIXES}
        return {**known, **{space: f"ns{index}" for index, space in enumerate(others, start=1)}, str(RDF): "rdf"}

    def write(self) -> str:
        roots = {node for node in self._graph.subjects() if node not in self._inside}
        named = sorted(node for node in roots if isinstance(node, URIRef))
        blank = sorted("".join(self._node(node, 1)) for node in roots if isinstance(node, BNode))
        spaces = "".join(
            f"\n         xmlns:{name}={quoteattr(space)}" for space, name in sorted(self._prefixes.items())
        )
        described = ["".join(self._node(node, 1)) for node in named]
        return f'<?xml version="1.0" encoding="UTF-8"?>\n<rdf:RDF{spaces}>\n{"".join(described + blank)}</rdf:RDF>\n'

    def _node(self, node: Node, depth: int) -> Iterator[str]:
        space = "  " * depth
        identity = ""
        if isinstance(node, URIRef):
            identity = f" rdf:about={_attribute(str(node))}"
        elif node in self._labels:
            identity = f' rdf:nodeID="{self._labels[node]}"'
        yield f"{space}<rdf:Description{identity}>\n"
        properties = [
            (str(predicate), "".join(self._property(predicate, value, depth + 1)))
            for predicate, value in self._graph.predicate_objects(node)
        ]
        for _, lines in sorted(properties):
            yield lines
        yield f"{space}</rdf:Description>\n"

    def _property(self, predicate: Node, value: Node, depth: int) -> Iterator[str]:
        start, local = _split(predicate)
        name, space = f"{self._prefixes[start]}:{local}", "  " * depth
        if isinstance(value, Literal):
            yield f"{space}<{name}{_literal_attribute(value)}>{_text(str(value))}</{name}>\n"
        elif isinstance(value, URIRef):
            yield f"{space}<{name} rdf:resource={_attribute(str(value))}/>\n"
        elif value not in self._inside:
            yield f'{space}<{name} rdf:nodeID="{self._labels[value]}"/>\n'
        else:
            items = self._items(value)
            kind = ' rdf:parseType="Collection"' if items else ""
            yield f"{space}<{name}{kind}>\n"
            for item in items or [value]:
                yield from self._item(item, depth + 1) if items else self._node(item, depth + 1)
            yield f"{space}</{name}>\n"

    def _item(self, item: Node, depth: int) -> Iterator[str]:
        if item in self._inside:
            yield from self._node(item, depth)
        else:
            identity = (
                f"about={_attribute(str(item))}" if item not in self._labels else f'nodeID="{self._labels[item]}"'
            )
            yield f"{'  ' * depth}<rdf:Description rdf:{identity}/>\n"

    def _items(self, node: Node) -> list[Node]:
        """Return the items of a plain list of things, empty for any other node."""
        items: list[Node] = []
        current = node
        while current != RDF.nil:
            found = list(self._graph.predicate_objects(current))
            values = dict(found)
            if len(found) != 2 or set(values) != {RDF.first, RDF.rest} or isinstance(values[RDF.first], Literal):
                return []
            if current not in self._inside:
                return []
            items.append(values[RDF.first])
            current = values[RDF.rest]
        return items


def _split(predicate: Node) -> tuple[str, str]:
    iri = str(predicate)
    match = LOCAL.search(iri)
    place = max(iri.rfind("#"), iri.rfind("/"), iri.rfind(":")) + 1
    if match is None or not LOCAL.match(iri[place:]):
        raise ValueError(f"the property <{iri}> must end with a name to be written as XML")
    return iri[:place], iri[place:]


def _literal_attribute(value: Literal) -> str:
    if value.language:
        return f" xml:lang={_attribute(value.language)}"
    return f" rdf:datatype={_attribute(str(value.datatype))}" if value.datatype else ""


def _checked(text: str) -> str:
    wrong = FORBIDDEN.search(text)
    if wrong is not None:
        raise ValueError(f"the text {text[:50]!r} has the character {wrong[0]!r}, which XML cannot hold")
    return text


def _attribute(text: str) -> str:
    return quoteattr(_checked(text))


def _text(text: str) -> str:
    return escape(_checked(text), {"\r": "&#13;"})
