"""Saves a knowledge base with what is so now, as one file that loads by itself."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import fail
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase, snapshot
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.rdf_xml import write_rdf_xml
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Fact
from regraft.whole_files import write_whole


def save(knowledge: KnowledgeBase, path: Path, facts: Iterable[Fact] = ()) -> None:
    """Write all files of a knowledge base and some more facts as one file in RDF/XML; raises KnowledgeError.

    The file is whole or as it was: a full disk leaves the old one. The same content gives the same bytes.
    """
    try:
        data = write_rdf_xml(snapshot(knowledge, facts))
    except (ValueError, RecursionError) as error:
        raise fail(str(path), 0, f"cannot be written: {error}") from None
    try:
        write_whole(path, data)
    except OSError as error:
        raise fail(str(path), 0, f"cannot be written: {error.strerror or error}") from None
