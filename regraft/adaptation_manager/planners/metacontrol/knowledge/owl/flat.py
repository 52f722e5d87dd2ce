"""Triples of RDF/XML in its plainest form, read in the same pass as the places of a file.

Files of individuals are flat: a description for each, with an IRI, and properties with an IRI or a text. rdflib takes
ten times as long for them. Everything else is left to rdflib: rules, lists, blank nodes, relative IRIs, languages.
RDF 1.1 XML Syntax (W3C recommendation of 25 February 2014), sections 2.2 to 2.4, 2.9 and 2.13.
"""

from __future__ import annotations

import re
from typing import Final, TypeAlias

from rdflib import RDF, Literal, URIRef

Triple: TypeAlias = tuple[URIRef, URIRef, URIRef | Literal]

SPACE: Final = f"{RDF} "
ABOUT, RESOURCE, DATATYPE = f"{SPACE}about", f"{SPACE}resource", f"{SPACE}datatype"
DESCRIPTION, TYPE = f"{SPACE}Description", f"{SPACE}type"
RDF_TYPE: Final = RDF.type
BASE: Final = "http://www.w3.org/XML/1998/namespace base"
ABSOLUTE: Final = re.compile(r"[a-z][a-z0-9+.-]*://[A-Za-z0-9.:_-]+(?:/[^\s?#;]*)?(?:#[^\s]+)?")
"""IRIs that no base changes."""

DESCRIBED, PROPERTY = 2, 3
"""How many elements there are around a description and around a property, themselves included."""


def is_absolute(iri: str) -> bool:
    """Return whether an IRI is the same, resolved against any base."""
    return ABSOLUTE.fullmatch(iri) is not None


class FlatTriples:
    """Receives a parser's events; ``triples`` has the file's triples, or is None as soon as one is not flat."""

    def __init__(self) -> None:
        self.triples: list[Triple] | None = []
        self._names: dict[str, URIRef | None] = {}
        self._literals: dict[tuple[str, str], Literal] = {}
        self._subject: URIRef | None = None
        self._predicate: URIRef | None = None
        self._value: URIRef | None = None
        self._datatype = ""
        self._text: list[str] = []

    def start(self, name: str, attributes: dict[str, str], depth: int) -> None:
        """Take the start of an element; the root has depth 1."""
        if self.triples is None:
            return
        if depth == DESCRIBED:
            done = self._describe(name, attributes)
        elif depth == PROPERTY:
            done = self._begin(name, attributes)
        else:
            done = depth == 1 and attributes.keys() <= {BASE} and all(map(is_absolute, attributes.values()))
        if not done:
            self.triples = None

    def end(self, depth: int) -> None:
        """Take the end of an element."""
        if self.triples is None or depth != PROPERTY:
            return
        assert self._subject is not None
        assert self._predicate is not None
        value = self._value if self._value is not None else self._literal()
        self.triples.append((self._subject, self._predicate, value))

    def characters(self, data: str, depth: int) -> None:
        """Take text; between elements there is only space."""
        if self.triples is None:
            return
        if depth == PROPERTY and self._value is None:
            self._text.append(data)
        elif not data.isspace():
            self.triples = None

    def _describe(self, name: str, attributes: dict[str, str]) -> bool:
        subject = self._name(attributes.get(ABOUT, ""))
        if subject is None or len(attributes) > 1 or self.triples is None:
            return False
        self._subject = subject
        if name == DESCRIPTION:
            return True
        kind = self._element(name)
        if kind is not None:
            self.triples.append((subject, RDF_TYPE, kind))
        return kind is not None

    def _begin(self, name: str, attributes: dict[str, str]) -> bool:
        self._predicate = RDF_TYPE if name == TYPE else self._element(name)
        resource = attributes.get(RESOURCE)
        self._value = None if resource is None else self._name(resource)
        self._datatype = "" if resource is not None else attributes.get(DATATYPE, "")
        self._text.clear()
        known = (resource is not None) + (DATATYPE in attributes)
        is_named = self._value is not None if resource is not None else name != TYPE and self._is_datatype(attributes)
        return self._predicate is not None and is_named and len(attributes) == known <= 1

    def _is_datatype(self, attributes: dict[str, str]) -> bool:
        return DATATYPE not in attributes or self._name(self._datatype) is not None

    def _element(self, name: str) -> URIRef | None:
        """Return the IRI of an element outside of RDF's own namespace."""
        space, _, local = name.partition(" ")
        return None if name.startswith(SPACE) or " " in local or not local else self._name(space + local)

    def _name(self, iri: str) -> URIRef | None:
        if iri not in self._names:
            self._names[iri] = URIRef(iri) if is_absolute(iri) else None
        return self._names[iri]

    def _literal(self) -> Literal:
        key = ("".join(self._text), self._datatype)
        if key not in self._literals:
            self._literals[key] = Literal(key[0], datatype=URIRef(key[1]) if key[1] else None)
        return self._literals[key]
