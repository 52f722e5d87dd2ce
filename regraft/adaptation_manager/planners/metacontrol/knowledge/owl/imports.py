"""Which file is meant by an import: one of those given, or one of those that Regraft has. Nothing is fetched.

An import names an ontology's IRI or version, or the address of a file, as published ontologies do: an address is
compared by the file's name.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final, TypeAlias

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError, Problem, fail
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.documents import Document, read_document
from regraft.bus_schema.suggestions import instead_of

ONTOLOGIES: Final = Path(__file__).parents[1] / "ontologies"
SHIPPED: Final = {
    "http://metacontrol.org/tomasys": ONTOLOGIES / "tomasys.owl",
    "http://ros/mros": ONTOLOGIES / "mros.owl",
    "http://ros/navigation_domain": ONTOLOGIES / "navigation.owl",
}
"""The ontologies that Regraft has, by IRI: where an import names none of the given files, these are used."""

MAX_FILES: Final = 64

Targets: TypeAlias = dict[str, list[tuple[str, Document]]]
"""The imports of each file, by its name: the IRI that it states, and the file that is meant."""


def read_all(files: Sequence[Path]) -> list[Document]:
    """Return the given files, then those that they import; raises KnowledgeError.

    The first file imports the later ones, whether or not it states so.
    """
    if len(files) > MAX_FILES:
        raise fail("", 0, f"{len(files)} files were given, at most {MAX_FILES} are allowed")
    return with_imports([read_document(path) for path in dict.fromkeys(files)])


def with_imports(given: Sequence[Document]) -> list[Document]:
    """Return some documents, then those that they import; raises KnowledgeError."""
    if not given:
        raise fail("", 0, "a knowledge base has at least one file")
    documents = list(given)
    problems: list[Problem] = []
    targets: Targets = {}
    queue = list(documents)
    while queue:
        document = queue.pop(0)
        targets[document.file] = []
        for target in document.imports:
            found = _find(target, documents)
            if found is None and (shipped := _shipped(target)) is not None:
                found = read_document(shipped)
                documents.append(found)
                queue.append(found)
            if found is None:
                problems.append(_missing(document, target, documents))
            else:
                targets[document.file].append((target, found))
    if problems:
        raise KnowledgeError(problems)
    _check_circles(documents, targets)
    return documents


def _shipped(target: str) -> Path | None:
    """Return the file that is shipped for an ontology's IRI."""
    return SHIPPED.get(_same_form(target))


def _find(target: str, documents: Sequence[Document]) -> Document | None:
    wanted = _same_form(target)
    for document in documents:
        if wanted in {_same_form(identity) for identity in document.identities}:
            return document
    if target.endswith(".owl"):
        name = target.rsplit("/", 1)[-1]
        return next((each for each in documents if name in _file_names(each)), None)
    return None


def _file_names(document: Document) -> set[str]:
    """Return the names that the file of an ontology has or may have: its own, and that of its IRI."""
    stems = {_same_form(identity).rsplit("/", 1)[-1] for identity in document.identities}
    return {Path(document.file).name, *(f"{stem}.owl" for stem in stems)}


def _same_form(iri: str) -> str:
    return iri.rstrip("#/")


def _missing(document: Document, target: str, documents: Sequence[Document]) -> Problem:
    known = {*SHIPPED, *(identity for each in documents for identity in each.identities)}
    why = f"imports {target!r}, which none of the given files is ({instead_of(target, known)})"
    return Problem(document.file, document.places.imports.get(target, 0), f"{why}. Nothing is fetched: add its file")


def _check_circles(documents: Sequence[Document], targets: Targets) -> None:
    done: set[str] = set()
    for document in documents:
        _visit(document, targets, [], done)


def _visit(document: Document, targets: Targets, path: list[Document], done: set[str]) -> None:
    if document.file in done:
        return
    path.append(document)
    for iri, target in targets[document.file]:
        start = next((index for index, each in enumerate(path) if each is target), None)
        if start is not None:
            circle = " -> ".join(each.file for each in [*path[start:], target])
            raise fail(document.file, document.places.imports.get(iri, 0), f"the imports are circular: {circle}")
        _visit(target, targets, path, done)
    path.pop()
    done.add(document.file)
