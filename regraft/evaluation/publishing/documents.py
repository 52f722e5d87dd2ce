"""Fills the tables of Markdown pages from tables of results: no page has a figure that no row has.

Two comments mark a table. The first names its kind, its file (from the page's folder) and more:

    <!-- table: measures; of: results/frog.csv; scenario: open; use: confirmation; measures: U_vis | U_det -->
    <!-- end of table -->

The kind ``measures`` shows mean and standard deviation by arm, and ``rows`` each run. The kind ``same`` shows which
arms did the same, ``runs`` what was run. The kind ``verdicts`` shows how the study's claims ended: with ``family``,
those of one family. A study that is not found by its name is named by ``study``. The text between the comments is
replaced.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from regraft.bus_schema.suggestions import instead_of
from regraft.evaluation.claims.judging import judge
from regraft.evaluation.claims.model import SeedSet
from regraft.evaluation.claims.reading import read_claims
from regraft.evaluation.finding import find_study, studies
from regraft.evaluation.reports.result_tables import measures_of, rows_of, runs_of, same_of, verdicts_of
from regraft.evaluation.results.table import ResultTable, read_table
from regraft.evaluation.study import Study

BEGIN: Final = re.compile(r"<!-- table: (?P<given>[^\n]*?) -->\n")
END: Final = "<!-- end of table -->"
ANY_MARK: Final = re.compile(r"<!--\s*(?:end of )?table\b", re.IGNORECASE)
FENCED: Final = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
BY_SCENARIO: Final = {"measures": measures_of, "rows": rows_of, "same": same_of}
FIELDS: Final = {
    **dict.fromkeys(BY_SCENARIO, ("of", "scenario", "use", "measures", "study")),
    "runs": ("of",),
    "verdicts": ("of", "use", "family", "study"),
}
"""The fields of each kind of table."""
USES: Final = (SeedSet.REPORTING.value, SeedSet.CONFIRMATION.value)
"""The uses of seeds that a page may show: runs for tuning are never published."""


class BadPage(ValueError):
    """A page whose tables cannot be filled; the text names page, line and field."""


@dataclass(frozen=True, slots=True)
class TableMark:
    """The beginning of a table: its kind, and fields."""

    kind: str
    fields: Mapping[str, str]


def filled(page: Path) -> str:
    """Return the text of a page with all its tables filled; raises BadPage, BadTable, StackError, NoSuchStudy."""
    text = page.read_text(encoding="utf-8")
    parts: list[str] = []
    at = 0
    marks = _marks(page, text)
    for match, end in marks:
        line = _line(text, match.start())
        parts += [text[at : match.end()], "\n", _table(page, line, _mark(page, line, match["given"])), "\n"]
        at = end
    return "".join([*parts, text[at:]])


def _marks(page: Path, text: str) -> list[tuple[re.Match[str], int]]:
    """Return the beginning of each table, and where its end is; examples in fences are none. Raises BadPage."""
    shown = FENCED.sub(lambda fence: " " * len(fence[0]), text)
    found: list[tuple[re.Match[str], int]] = []
    at = 0
    while mark := ANY_MARK.search(shown, at):
        begin = BEGIN.match(shown, mark.start())
        if begin is None:
            right = "<!-- table: KIND; FIELD: VALUE --> alone on a line, and <!-- end of table --> behind it"
            raise BadPage(f"{page}:{_line(text, mark.start())}: is no mark of a table: must be {right}")
        following = ANY_MARK.search(shown, begin.end())
        if following is None or not shown.startswith(END, following.start()):
            raise BadPage(f"{page}:{_line(text, mark.start())}: a table has no end: must be followed by {END}")
        found.append((begin, following.start()))
        at = following.start() + len(END)
    return found


def _line(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1


def _mark(page: Path, line: int, given: str) -> TableMark:
    kind, *rest = (part.strip() for part in given.split(";"))
    if kind not in FIELDS:
        raise BadPage(f"{page}:{line}: there is no table {kind!r}; {instead_of(kind, FIELDS)}")
    fields: dict[str, str] = {}
    for part in filter(None, rest):
        name, colon, value = part.partition(":")
        if not colon or name.strip() not in FIELDS[kind]:
            why = instead_of(name.strip(), FIELDS[kind])
            raise BadPage(f"{page}:{line}: a table {kind!r} has no field {name.strip()!r}; {why}")
        if name.strip() in fields:
            raise BadPage(f"{page}:{line}: {name.strip()}: is given twice: leave one out")
        fields[name.strip()] = value.strip()
    if "of" not in fields:
        raise BadPage(f"{page}:{line}: of: is missing: the file of results, from the page's folder")
    return TableMark(kind, fields)


def _table(page: Path, line: int, mark: TableMark) -> str:
    results = read_table(page.parent / mark.fields["of"])
    use = mark.fields.get("use", "")
    if use and use not in USES:
        raise BadPage(f"{page}:{line}: use: there is no use {use!r}; {instead_of(use, USES)}")
    if mark.kind == "runs":
        return runs_of(results)
    if mark.kind == "verdicts":
        return _verdicts(page, line, mark, results, SeedSet(use or SeedSet.CONFIRMATION.value))
    study = _study_of(mark, results)
    if study is not None and results.rows and results.rows[0].definitions in study.claims and not use:
        raise BadPage(f"{page}:{line}: use: is missing: the study has claims; must be one of {', '.join(USES)}")
    results = results.used_for(use) if use else results
    scenario = mark.fields.get("scenario", "")
    if scenario not in results.scenarios():
        raise BadPage(
            f"{page}:{line}: scenario: there is none {scenario!r}; {instead_of(scenario, results.scenarios())}"
        )
    measures = [name.strip() for name in mark.fields.get("measures", "").split("|") if name.strip()]
    for name in measures:
        if name not in results.measures:
            raise BadPage(f"{page}:{line}: measures: there is none {name!r}; {instead_of(name, results.measures)}")
    return BY_SCENARIO[mark.kind](results, scenario, measures)


def _verdicts(page: Path, line: int, mark: TableMark, results: ResultTable, use: SeedSet) -> str:
    study = _study_of(mark, results)
    definitions = results.rows[0].definitions if results.rows else ""
    if study is None or definitions not in study.claims:
        raise BadPage(f"{page}:{line}: {mark.fields['of']} is of no study with claims")
    claims = read_claims(study.claims[definitions], study)
    judged = judge(claims, results, use)
    family = mark.fields.get("family", "")
    families = [claim.family for claim in claims.claims]
    if family and family not in families:
        raise BadPage(f"{page}:{line}: family: there is none {family!r}; {instead_of(family, families)}")
    return verdicts_of([each for each in judged if not family or each.claim.family == family])


def _study_of(mark: TableMark, results: ResultTable) -> Study | None:
    """Return the study of results, None for one that is known by its module alone, or for no runs."""
    name = mark.fields.get("study") or (results.rows[0].study if results.rows else "")
    return find_study(name) if name in studies() or ":" in mark.fields.get("study", "") else None
