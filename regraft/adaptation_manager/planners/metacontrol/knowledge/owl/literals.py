"""RDF's nodes as terms of facts, and back."""

from __future__ import annotations

import math
from decimal import Decimal

from rdflib import RDF, XSD, BNode, Graph, Literal, URIRef
from rdflib.term import Node

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import (
    NUMBER,
    TEXT,
    TRUTH,
    Data,
    Fact,
    Term,
    number,
    text,
    truth,
)


def term_of(node: Node) -> Term:
    """Return a node as a term; raises ValueError for a literal that its datatype does not allow."""
    if not isinstance(node, Literal):
        return str(node)
    value = node.value
    if node.ill_typed:
        raise ValueError(f"the value {str(node)!r} is no {str(node.datatype).rsplit('#', 1)[-1]}")
    if isinstance(value, bool):
        return truth(value)
    if isinstance(value, int | float | Decimal):
        if not math.isfinite(value):
            raise ValueError(f"the value {str(node)!r} must be a finite number")
        try:
            return number(float(value))
        except OverflowError:
            raise ValueError(f"the value {str(node)!r} is too large") from None
    if node.language is None and node.datatype in {None, XSD.string}:
        return text(str(node))
    return Data(f"@{node.language}" if node.language else str(node.datatype), str(node))


def node_of(term: Term) -> URIRef | BNode | Literal:
    """Return a term as a node; numbers become decimals, as TOMASys has them."""
    if isinstance(term, str):
        return URIRef(term)
    if term.kind == NUMBER:
        return Literal(_decimal(float(term.value)), datatype=XSD.decimal)
    if term.kind == TRUTH:
        return Literal("true" if term.value else "false", datatype=XSD.boolean)
    if term.kind == TEXT:
        return Literal(str(term.value), datatype=XSD.string)
    if term.kind.startswith("@"):
        return Literal(str(term.value), lang=term.kind[1:])
    return Literal(str(term.value), datatype=URIRef(term.kind))


def _decimal(value: float) -> str:
    """Return the shortest decimal, without an exponent, that is this number.

    >>> _decimal(0.5), _decimal(1e-7)
    ('0.5', '0.0000001')
    """
    digits = format(Decimal(repr(value)), "f")
    return digits if "." in digits else f"{digits}.0"


def add_fact(graph: Graph, fact: Fact) -> None:
    """Add a fact to a graph."""
    subject = URIRef(str(fact[1]))
    if len(fact) == 2:
        graph.add((subject, RDF.type, URIRef(fact[0])))
    else:
        graph.add((subject, URIRef(fact[0]), node_of(fact[2])))
