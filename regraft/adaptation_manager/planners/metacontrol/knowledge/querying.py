"""Answers SPARQL queries (W3C recommendation of 21 March 2013) on a knowledge base: SELECT and ASK, within bounds.

Nothing outside is asked: SERVICE and FROM are refused. REGEX and REPLACE are too, since no bound holds inside them.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, Final

from pyparsing.exceptions import ParseException
from rdflib import XSD, Graph, Literal
from rdflib.plugins.sparql import prepareQuery
from rdflib.plugins.sparql.parserutils import CompValue
from rdflib.plugins.sparql.sparql import Query, SPARQLError

from regraft.adaptation_manager.planners.metacontrol.knowledge import vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase, snapshot
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Fact

MAX_CHARACTERS: Final = 16 * 1024
MAX_NESTING: Final = 20
"""Brackets inside each other: the parser's time doubles with each."""
MAX_ROWS: Final = 10_000
MAX_TRIPLES: Final = 5_000_000
SECONDS: Final = 5.0

PREFIXES: Final = {
    "tomasys": vocabulary.TOMASYS,
    "mros": vocabulary.MROS,
    "owl": "http://www.w3.org/2002/07/owl#",
    "rdf": "http://www.w3.org/1999/02/22-rdf-syntax-ns#",
    "rdfs": "http://www.w3.org/2000/01/rdf-schema#",
    "swrl": "http://www.w3.org/2003/11/swrl#",
    "xsd": "http://www.w3.org/2001/XMLSchema#",
}
"""Prefixes that a query may use without declaring them."""

FORBIDDEN: Final = {
    "ServiceGraphPattern": "SERVICE asks another machine",
    "DatasetClause": "FROM loads other data",
    "Builtin_REGEX": "REGEX may take any time: use CONTAINS, STRSTARTS or STRENDS",
    "Builtin_REPLACE": "REPLACE may take any time",
    "Builtin_CONCAT": "CONCAT may make texts of any length",
    "Builtin_ENCODE_FOR_URI": "ENCODE_FOR_URI may make texts of any length",
    "Aggregate_GroupConcat": "GROUP_CONCAT may make texts of any length",
}
STRINGS: Final = re.compile(
    r"\"\"\".*?\"\"\"|'''.*?'''|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'|<[^<>\s]*>|#.*", re.DOTALL
)

EVERY_VARIABLE: Final = re.compile(r"\A[^{]*\bselect\s+(?:distinct\s+|reduced\s+)?\*", re.IGNORECASE)

Cell = str | float | bool | None


class QueryError(ValueError):
    """A query that is wrong, refused, or beyond a bound."""


@dataclass(frozen=True, slots=True)
class QueryResult:
    """The result of a query: ``rows`` of SELECT, by ``columns``, or the ``answer`` of ASK, which is None for SELECT."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    answer: bool | None = None


def query(knowledge: KnowledgeBase, text: str, facts: Iterable[Fact] = (), *, seconds: float = SECONDS) -> QueryResult:
    """Return what a query finds in the files of a knowledge base and some more facts; raises QueryError.

    ``seconds`` bounds the time of the evaluation.
    """
    prepared = _prepared(text)
    graph = _BoundedGraph(time.monotonic() + seconds, seconds)
    # The store keeps the order of its triples, so that equal questions have equal answers.
    for triple in sorted(snapshot(knowledge, facts), key=lambda each: tuple(map(str, each))):
        subject, predicate, value = triple
        if isinstance(value, Literal) and value.datatype == XSD.string:
            value = Literal(str(value))  # RDF 1.1 has both forms of a text as one, rdflib compares them as two
        graph.add((subject, predicate, value))
    try:
        result = graph.query(prepared)
        if result.type == "ASK":
            return QueryResult((), (), bool(result.askAnswer))
        names_of_all = [str(name) for name in result.vars or ()]
        columns = sorted(names_of_all) if EVERY_VARIABLE.search(STRINGS.sub(" ", text)) else names_of_all
        order = [names_of_all.index(name) for name in columns]
        return QueryResult(tuple(columns), tuple(_rows(result, order)))
    except RecursionError:
        raise QueryError("the query is too deep") from None
    except (SPARQLError, NotImplementedError, TypeError, KeyError) as error:
        raise QueryError(f"the query cannot be answered: {error}") from None


def _prepared(text: str) -> Query:
    if len(text) > MAX_CHARACTERS:
        raise QueryError(f"the query has {len(text)} characters, must have at most {MAX_CHARACTERS}")
    depth = deepest = 0
    for character in STRINGS.sub(" ", text):
        depth += (character in "({[") - (character in ")}]")
        deepest = max(deepest, depth)
    if deepest > MAX_NESTING:
        raise QueryError(f"the query has {deepest} brackets inside each other, must have at most {MAX_NESTING}")
    try:
        prepared = prepareQuery(text, initNs=PREFIXES)
    except ParseException as error:
        raise QueryError(f"line {error.lineno}, column {error.column}: this is no SELECT or ASK query") from None
    except RecursionError:
        raise QueryError("the query is too deep") from None
    except Exception as error:  # rdflib raises bare ones, as for unknown prefixes
        raise QueryError(f"the query is wrong: {error}") from None
    if prepared.algebra.name not in {"SelectQuery", "AskQuery"}:
        raise QueryError(f"this is a {prepared.algebra.name}, must be SELECT or ASK")
    for name in _parts(prepared.algebra):
        if name in FORBIDDEN:
            raise QueryError(f"{FORBIDDEN[name]}; it is refused")
    return prepared


def _parts(value: Any) -> Iterator[str]:
    """Yield the names of all parts of a query."""
    waiting = [value]
    while waiting:
        part = waiting.pop()
        if isinstance(part, CompValue):
            yield part.name
            waiting += part.values()
            if dict.get(part, "datasetClause"):  # the part's own get evaluates
                yield "DatasetClause"
        elif isinstance(part, dict):
            waiting += part.values()
        elif isinstance(part, list | tuple | set):
            waiting += part


def _rows(result: Iterable[Any], order: list[int]) -> Iterator[tuple[Cell, ...]]:
    for count, row in enumerate(result, start=1):
        if count > MAX_ROWS:
            raise QueryError(f"the query has more than {MAX_ROWS} rows: give it a LIMIT")
        yield tuple(_cell(row[index]) for index in order)


def _cell(value: Any) -> Cell:
    if value is None:
        return None
    plain = value.toPython() if isinstance(value, Literal) else str(value)
    if isinstance(plain, bool):
        return plain
    return float(plain) if isinstance(plain, int | float | Decimal) else str(value)


class _BoundedGraph(Graph):
    """A graph that is asked for a limited number of triples, until a time."""

    def __init__(self, until: float, seconds: float) -> None:
        super().__init__()
        self._until = until
        self._seconds = seconds
        self._left = MAX_TRIPLES

    def triples(self, triple: Any) -> Any:
        """Yield triples, within the bounds."""
        self._check()
        for found in super().triples(triple):
            self._check()
            yield found

    def _check(self) -> None:
        self._left -= 1
        if self._left < 0 or time.monotonic() > self._until:
            raise QueryError(f"the query takes longer than {self._seconds:g} s: ask for less")
