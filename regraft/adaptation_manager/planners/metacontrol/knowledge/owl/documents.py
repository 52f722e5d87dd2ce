"""Reads one OWL file in RDF/XML, within limits; facts and axioms come later."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rdflib import OWL, RDF, Graph, URIRef
from rdflib.exceptions import Error as RdfError

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import fail
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.scanning import Places, scan

MAX_BYTES: Final = 16 * 2**20
"""Size of a file; 1,500 designs with three qualities have some 4 MiB."""
MAX_TRIPLES: Final = 300_000


@dataclass(frozen=True, slots=True)
class Document:
    """One file: its triples, its places, the IRIs that its ontology has, and what it imports.

    ``origins`` are the places of individuals that another text describes, from which this one was made.
    """

    file: str
    graph: Graph
    places: Places
    identities: frozenset[str]
    imports: tuple[str, ...]
    origins: Mapping[str, tuple[str, int]] | None = None

    def place(self, individual: str) -> tuple[str, int]:
        """Return the file and the line where an individual is described first; line 0 where none does."""
        if self.origins is not None:
            return self.origins.get(individual, (self.file, 0))
        return self.file, self.places.line(individual)


def read_document(path: Path) -> Document:
    """Return what a file holds; raises KnowledgeError where it cannot be read or is no RDF/XML."""
    file = str(path)
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise fail(file, 0, f"cannot be read: {error.strerror or error}") from None
    if len(data) > MAX_BYTES:
        raise fail(file, 0, f"has more than {MAX_BYTES} bytes")
    return document_of(data, file, path.absolute().as_uri())


def document_of(data: bytes, file: str, base: str) -> Document:
    """Return what RDF/XML holds; relative IRIs in it are resolved against ``base``. Raises KnowledgeError."""
    scanned = scan(data, file, base)
    graph = Graph()
    if scanned.triples is not None:
        graph.addN((*triple, graph) for triple in scanned.triples)
    else:
        _parse(graph, data, file, base)
    if len(graph) > MAX_TRIPLES:
        raise fail(file, 0, f"has {len(graph)} triples, must have at most {MAX_TRIPLES}")
    if not len(graph):
        raise fail(file, 0, "holds no triples, must be an OWL file in RDF/XML")
    ontologies = sorted(node for node in graph.subjects(RDF.type, OWL.Ontology) if isinstance(node, URIRef))
    versions = {str(version) for node in ontologies for version in graph.objects(node, OWL.versionIRI)}
    imports = sorted({str(target) for node in ontologies for target in graph.objects(node, OWL.imports)})
    return Document(file, graph, scanned.places, frozenset(map(str, ontologies)) | versions, tuple(imports))


def _parse(graph: Graph, data: bytes, file: str, base: str) -> None:
    try:
        graph.parse(data=data, format="xml", publicID=base)
    except (RdfError, ValueError, AssertionError, KeyError, TypeError, AttributeError, RecursionError) as error:
        # rdflib raises several kinds for RDF/XML that is well-formed as XML alone.
        raise fail(file, 0, f"is no RDF/XML: {error or type(error).__name__}") from None
