"""``regraft skills kb``: saves the knowledge base of files of skills and OWL files, and answers queries on it.

rdflib and textX are imported when a command runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.options import JsonOption
from regraft.cli.terminal.output import say, show_json, show_table

if TYPE_CHECKING:
    from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase
    from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.documents import Document
    from regraft.adaptation_manager.planners.metacontrol.knowledge.querying import Cell

kb = typer.Typer(help="Save and query the knowledge base of skills.", no_args_is_help=True, rich_markup_mode=None)

OWL_SUFFIX: Final = ".owl"
MAX_QUERY: Final = 64 * 1024
"""Bytes of a query's file; the query itself has at most 16 Ki characters."""

FilesArgument = Annotated[
    list[Path], typer.Argument(metavar="FILE...", help="Files of skills, or OWL files in RDF/XML, or both.")
]


@kb.command("save")
def save(
    files: FilesArgument,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The OWL file to write, in RDF/XML.")],
) -> None:
    """Write the knowledge base with all that it imports as one OWL file."""
    knowledge = _knowledge(files)
    from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
    from regraft.adaptation_manager.planners.metacontrol.knowledge.saving import save as save_base

    try:
        save_base(knowledge, out)
    except KnowledgeError as error:
        raise BadInput(f"--out {error}") from None
    say(f"{out}: {len(knowledge.facts)} facts and {len(knowledge.rules)} rules of {len(knowledge.files)} files")


@kb.command("query")
def query(
    files: FilesArgument,
    sparql: Annotated[
        str, typer.Option("--sparql", metavar="TEXT|FILE", help="A SELECT or ASK query, or a file with one.")
    ],
    as_json: JsonOption = False,
) -> None:
    """Answer a SPARQL query on the knowledge base; the prefixes tomasys, mros, owl, rdf and rdfs are known."""
    text = _query_text(sparql)
    knowledge = _knowledge(files)
    from regraft.adaptation_manager.planners.metacontrol.knowledge.querying import QueryError
    from regraft.adaptation_manager.planners.metacontrol.knowledge.querying import query as ask

    try:
        result = ask(knowledge, text)
    except QueryError as error:
        raise BadInput(f"--sparql: {error}") from None
    if as_json:
        shown = {"columns": list(result.columns), "rows": [list(row) for row in result.rows]}
        show_json(shown if result.answer is None else {"answer": result.answer})
    elif result.answer is not None:
        say("yes" if result.answer else "no")
    else:
        show_table(result.columns, [list(map(_shown, row)) for row in result.rows], empty="nothing was found")


def _knowledge(files: list[Path]) -> KnowledgeBase:
    """Return the knowledge base of some files; raises BadInput."""
    from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError
    from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import base_of
    from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.imports import MAX_FILES, with_imports

    if len(files) > MAX_FILES:
        raise BadInput(f"FILE...: {len(files)} files were given, at most {MAX_FILES} are allowed")
    try:
        documents = [each for file in dict.fromkeys(files) for each in _documents(file)]
        # Several files of skills may bring the ontology of one domain.
        return base_of(with_imports(list({each.file: each for each in documents}.values())))
    except KnowledgeError as error:
        raise BadInput(str(error)) from None


def _documents(file: Path) -> list[Document]:
    """Return what a file holds; raises BadInput and KnowledgeError."""
    from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.documents import read_document
    from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import SkillsError
    from regraft.adaptation_manager.planners.metacontrol.skills.knowledge import documents_of
    from regraft.adaptation_manager.planners.metacontrol.skills.reading import SUFFIXES, read_skills

    if file.suffix == OWL_SUFFIX:
        return [read_document(file)]
    if file.suffix not in SUFFIXES:
        raise BadInput(f"{file}: must be a file of skills or an OWL file: {', '.join((*SUFFIXES, OWL_SUFFIX))}")
    try:
        return documents_of(read_skills(file))
    except SkillsError as error:
        raise BadInput(str(error)) from None


def _query_text(given: str) -> str:
    """Return a query, from a file where there is one of that name; raises BadInput."""
    path = Path(given)
    try:
        if not path.exists():
            if "{" not in given:  # every query has one
                raise BadInput(f"--sparql {given}: is neither a SPARQL query nor a file")
            return given
        if not path.is_file():
            raise BadInput(f"--sparql {given}: is no file")
        with path.open("rb") as stream:
            data = stream.read(MAX_QUERY + 1)
        text = data.decode()
    except UnicodeDecodeError:
        raise BadInput(f"--sparql {given}: is not UTF-8 text") from None
    except (OSError, ValueError) as error:
        if "{" in given:  # too long, or with signs that no path has: a query
            return given
        raise BadInput(f"--sparql {given}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(data) > MAX_QUERY:
        raise BadInput(f"--sparql {given}: has more than {MAX_QUERY} bytes")
    return text


def _shown(cell: Cell) -> object:
    """Return a cell for people: of names that are IRIs, the part that they read."""
    from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name

    if isinstance(cell, str) and "://" in cell and not any(character.isspace() for character in cell):
        return local_name(cell)
    return "" if cell is None else f"{cell:g}" if isinstance(cell, float) else cell
