"""Looks through an RDF/XML file before it is parsed: limits, the lines on which things stand, and plain triples.

rdflib keeps no lines, and would follow entities without a bound.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final
from urllib.parse import urldefrag, urljoin
from xml.parsers import expat

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError, fail
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.flat import FlatTriples, Triple, is_absolute

RDF: Final = "http://www.w3.org/1999/02/22-rdf-syntax-ns# "
XML_BASE: Final = "http://www.w3.org/XML/1998/namespace base"
OWL_IMPORTS: Final = "http://www.w3.org/2002/07/owl# imports"
LABEL: Final = "http://www.w3.org/2000/01/rdf-schema# label"

MAX_DEPTH: Final = 400
"""Elements inside each other; a rule of 14 atoms, as published, has some 65."""
MAX_EXPANDED: Final = 64 * 2**20
MAX_ENTITIES: Final = 200
MAX_ENTITY: Final = 1000


@dataclass(slots=True)
class Places:
    """The lines of a file's subjects, of its imports, and of what has a label, by IRI and by text."""

    subjects: dict[str, int] = field(default_factory=dict)
    imports: dict[str, int] = field(default_factory=dict)
    labels: dict[str, int] = field(default_factory=dict)

    def line(self, iri: str) -> int:
        """Return the line of a subject, 0 if it is unknown."""
        return self.subjects.get(iri, 0)


@dataclass(frozen=True, slots=True)
class Scanned:
    """The places of a file, and its triples; ``triples`` is None where rdflib has to read them."""

    places: Places
    triples: list[Triple] | None


def scan(data: bytes, file: str, base: str) -> Scanned:
    """Return what a file holds; raises KnowledgeError where it is no XML, or beyond a limit."""
    return _Scanner(file, base).scan(data)


class _Scanner:
    """Receives the parser's events."""

    def __init__(self, file: str, base: str) -> None:
        self._file = file
        self._places = Places()
        self._flat = FlatTriples()
        self._bases = [base]
        self._lines: list[int] = []
        self._label: list[str] | None = None
        self._expanded = 0
        self._entities = 0
        self._parser = expat.ParserCreate(namespace_separator=" ")
        self._parser.buffer_text = True
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._characters
        self._parser.EntityDeclHandler = self._entity

    def scan(self, data: bytes) -> Scanned:
        try:
            self._parser.Parse(data, True)
        except expat.ExpatError as error:
            raise fail(self._file, error.lineno, f"is not well-formed XML: {expat.ErrorString(error.code)}") from None
        return Scanned(self._places, self._flat.triples)

    def _fail(self, why: str) -> KnowledgeError:
        return fail(self._file, self._parser.CurrentLineNumber, why)

    def _grow(self, count: int) -> None:
        self._expanded += count
        if self._expanded > MAX_EXPANDED:
            raise self._fail(f"its entities expand to more than {MAX_EXPANDED} characters")

    def _entity(
        self,
        name: str,
        is_parameter: bool,
        value: str | None,
        base: str | None,
        system_id: str | None,
        public_id: str | None,
        notation: str | None,
    ) -> None:
        self._entities += 1
        if value is None or is_parameter:
            raise self._fail(f"the entity {name!r} is not in the file itself, must be a plain text")
        if "&" in value or len(value) > MAX_ENTITY or self._entities > MAX_ENTITIES:
            raise self._fail(
                f"the entity {name!r} is refused: at most {MAX_ENTITIES} entities"
                f" of at most {MAX_ENTITY} characters, none inside another"
            )

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._grow(len(name) + sum(len(key) + len(value) for key, value in attributes.items()))
        line = self._parser.CurrentLineNumber
        self._lines.append(line)
        if len(self._lines) == 1 and name != f"{RDF}RDF":
            raise self._fail(f"the first element is {name.rpartition(' ')[2]!r}, must be rdf:RDF")
        if len(self._lines) > MAX_DEPTH:
            raise self._fail(f"more than {MAX_DEPTH} elements are inside each other")
        base = attributes.get(XML_BASE, self._bases[-1])
        self._bases.append(base)
        self._label = [] if name == LABEL else None
        subject = _subject(attributes, base)
        if subject is not None:
            self._places.subjects.setdefault(subject, line)
        target = attributes.get(f"{RDF}resource")
        if target is not None and name == OWL_IMPORTS:
            self._places.imports.setdefault(_resolved(target, base), line)
        self._flat.start(name, attributes, len(self._lines))

    def _end(self, name: str) -> None:
        self._flat.end(len(self._lines))
        self._lines.pop()
        self._bases.pop()
        if name == LABEL and self._label is not None and self._lines:
            self._places.labels.setdefault("".join(self._label).strip(), self._lines[-1])
        self._label = None

    def _characters(self, data: str) -> None:
        self._grow(len(data))
        self._flat.characters(data, len(self._lines))
        if self._label is not None:
            self._label.append(data)


def _subject(attributes: dict[str, str], base: str) -> str | None:
    about = attributes.get(f"{RDF}about")
    if about is not None:
        return _resolved(about, base)
    identity = attributes.get(f"{RDF}ID")
    return f"{urldefrag(base)[0]}#{identity}" if identity is not None else None


def _resolved(reference: str, base: str) -> str:
    if is_absolute(reference):
        return reference
    try:
        return urljoin(base, reference, allow_fragments=True) if reference else base
    except ValueError:
        return reference
