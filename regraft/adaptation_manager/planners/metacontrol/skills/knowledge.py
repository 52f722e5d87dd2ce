"""The knowledge base of skills, made in memory from the individuals that are generated and the shipped ontologies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase, base_of
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.documents import Document, document_of, read_document
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.imports import ONTOLOGIES, with_imports
from regraft.adaptation_manager.planners.metacontrol.skills.generators.owl import Individuals, individuals
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import every_component
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY as SHIPPED
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet

DOMAINS: Final = {"navigation_definitions.skills": ONTOLOGIES / "navigation.owl"}
"""Ontologies of domains, by the file of the library that has the same definitions."""

LIBRARY: Final = SHIPPED.resolve()

Origins = dict[str, tuple[str, int]]


def knowledge_of(skills: SkillSet, further: Sequence[Path] = ()) -> KnowledgeBase:
    """Return the knowledge base of skills, as they are read from a file; raises KnowledgeError.

    It has the levels of TOMASys and of MROS, and the individuals of the skills. Files of the library may define a
    domain: skills that import one have the ontology of that domain, with its rules. ``further`` are OWL files with
    more rules and individuals.
    """
    return base_of(with_imports([*documents_of(skills), *map(read_document, further)]))


def documents_of(skills: SkillSet) -> list[Document]:
    """Return the individuals of skills as a document, then the ontologies of the domains that they import."""
    made = individuals(skills)
    document = document_of(made.text.encode(), skills.file, Path(skills.file).absolute().as_uri())
    document = replace(document, origins=_origins(skills, made, document))
    imported = {path.name for path in (Path(each.file).resolve() for each in skills.files) if path.parent == LIBRARY}
    return [document, *(read_document(DOMAINS[name]) for name in sorted(imported & DOMAINS.keys()))]


def _origins(skills: SkillSet, made: Individuals, document: Document) -> Origins:
    """Return where the skills have what the individuals were made from."""
    domain, mros = made.namespaces.domain, made.namespaces.mros
    named = [
        *((domain + each.name, each.place) for each in skills.skills),
        *((mros + each.name, each.place) for each in skills.qualities),
        *((domain + each.name, each.place) for each in every_component(skills)),
        *((iri, each.place) for each, iri in (*made.designs, *made.rests)),
    ]
    found: Origins = {}
    for iri, place in named:
        found.setdefault(iri, (place.file, place.line))
    # The other individuals are values of designs: those have the place of the line's design.
    for iri, line in document.places.subjects.items():
        owner = made.owners[line - 1]
        if owner in found:
            found.setdefault(iri, found[owner])
    return found
