"""Reads one OWL file in RDF/XML, within limits; facts and axioms come later."""

from __future__ import annotations

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
    """One file: its triples, its places, the IRIs that its ontology has, and what it imports."""

    file: str
    graph: Graph
    places: Places
    identities: frozenset[str]
    imports: tuple[str, ...]


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
    base = path.absolute().as_uri()
    places = scan(data, file, base)
    graph = Graph()
    try:
        graph.parse(data=data, format="xml", publicID=base)
    except (RdfError, ValueError, AssertionError, KeyError, TypeError, AttributeError, RecursionError) as error:
        # rdflib raises several kinds for RDF/XML that is well-formed as XML alone.
        raise fail(file, 0, f"is no RDF/XML: {error or type(error).__name__}") from None
    if len(graph) > MAX_TRIPLES:
        raise fail(file, 0, f"has {len(graph)} triples, must have at most {MAX_TRIPLES}")
    if not len(graph):
        raise fail(file, 0, "holds no triples, must be an OWL file in RDF/XML")
    ontologies = sorted(node for node in graph.subjects(RDF.type, OWL.Ontology) if isinstance(node, URIRef))
    versions = {str(version) for node in ontologies for version in graph.objects(node, OWL.versionIRI)}
    imports = sorted({str(target) for node in ontologies for target in graph.objects(node, OWL.imports)})
    return Document(file, graph, places, frozenset(map(str, ontologies)) | versions, tuple(imports))
