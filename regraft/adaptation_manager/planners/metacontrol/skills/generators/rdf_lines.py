"""Lines of RDF/XML: elements of individuals and of their properties, one assertion a line."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import Final
from xml.sax.saxutils import escape, quoteattr

RDF: Final = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
OWL: Final = "http://www.w3.org/2002/07/owl#"
XSD: Final = "http://www.w3.org/2001/XMLSchema#"


@dataclass(frozen=True, slots=True)
class Namespaces:
    """The namespaces of the terms and of the individuals; by default the published ones."""

    tomasys: str = "http://metacontrol.org/tomasys#"
    mros: str = "http://ros/mros#"
    domain: str = "http://ros/navigation_domain#"


PUBLISHED: Final = Namespaces()


def element(kind: str, iri: str, *below: str) -> list[str]:
    """Return an individual of a class, with the lines of its properties."""
    begin = f"  <{kind} rdf:about={quoteattr(iri)}"
    return [f"{begin}>", *below, f"  </{kind}>"] if below else [f"{begin}/>"]


def resource(name: str, iri: str) -> str:
    """Return a property whose value is an individual."""
    return f"    <{name} rdf:resource={quoteattr(iri)}/>"


def number(name: str, value: float) -> str:
    """Return a property whose value is a number."""
    return _typed(name, "decimal", _decimal(value))


def truth(name: str, value: bool) -> str:
    """Return a property whose value is true or false."""
    return _typed(name, "boolean", "true" if value else "false")


def text(name: str, value: str) -> str:
    """Return a property whose value is a text."""
    return _typed(name, "string", escape(value))


def without_mark(namespace: str) -> str:
    """Return the IRI of the ontology that has a namespace."""
    return namespace.rstrip("#/")


def _typed(name: str, kind: str, value: str) -> str:
    return f'    <{name} rdf:datatype="{XSD}{kind}">{value}</{name}>'


def _decimal(value: float) -> str:
    """Return a number as xsd:decimal has it, without an exponent."""
    return format(Decimal(repr(value)), "f")
