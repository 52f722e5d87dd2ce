"""A table of results as a CSV file: a row a run, with its measures, its digest, and what it was made with."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

LONGEST_RUN = 1e6
"""Simulated seconds."""
ABOUT = (
    "study",
    "definitions",
    "arm",
    "scenario",
    "use",
    "seed",
    "number",
    "seconds",
    "digest",
    "code",
    "versions",
    "renderer",
)
"""The columns before those of the measures."""
MAX_SEED = 2**63 - 1
"""The largest seed, and number of a run."""
SIGNIFICANT = 10
"""Digits of a measure: more than any table shows, fewer than processors differ in."""


class BadTable(ValueError):
    """A file that is no table of results; the text names file, line and column."""


@dataclass(frozen=True, slots=True)
class ResultRow:
    """One run: what was run, with what, how it is recognized, and its measures (NaN where undetermined).

    ``use`` is that of its seed, empty for one of no set. ``digest`` is of all rows and adaptations of the run;
    ``code`` is the hash of Regraft's code then.
    """

    study: str
    definitions: str
    arm: str
    scenario: str
    use: str
    seed: int
    number: int
    seconds: float
    digest: str
    code: str
    versions: str
    renderer: str
    measures: Mapping[str, float]

    @property
    def configuration(self) -> str:
        """Return the key of the run's configuration."""
        return f"{self.arm}.{self.scenario}" if self.scenario else self.arm


@dataclass(frozen=True, slots=True)
class ResultTable:
    """Runs, and the names of their measures."""

    measures: tuple[str, ...]
    rows: tuple[ResultRow, ...]
    file: str = field(default="", compare=False)

    def scenarios(self) -> tuple[str, ...]:
        """Return the scenarios in the order of the rows."""
        return tuple(dict.fromkeys(row.scenario for row in self.rows))

    def arms(self, scenario: str) -> tuple[str, ...]:
        """Return the arms of a scenario in the order of the rows."""
        return tuple(dict.fromkeys(row.arm for row in self.rows if row.scenario == scenario))

    def used_for(self, *uses: str) -> ResultTable:
        """Return the table of the runs whose seeds are of some uses."""
        return ResultTable(self.measures, tuple(row for row in self.rows if row.use in uses), self.file)

    def with_seeds(self, seeds: Collection[int]) -> ResultTable:
        """Return the table of the runs of some seeds."""
        return ResultTable(self.measures, tuple(row for row in self.rows if row.seed in seeds), self.file)

    def of(self, scenario: str, arm: str) -> dict[tuple[int, int], ResultRow]:
        """Return an arm's runs by seed and, for several of one seed, number."""
        repeated = len({row.seed for row in self.rows if row.arm == arm and row.scenario == scenario}) == 1
        found = [row for row in self.rows if row.arm == arm and row.scenario == scenario]
        return {(row.seed, row.number if repeated else 0): row for row in found}

    def values(self, scenario: str, arm: str, measure: str) -> dict[tuple[int, int], float]:
        """Return a measure of each of an arm's runs that determines it."""
        found = {place: row.measures[measure] for place, row in self.of(scenario, arm).items()}
        return {place: value for place, value in found.items() if math.isfinite(value)}


def table_text(table: ResultTable) -> str:
    """Return the CSV file of a table."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow((*ABOUT, *table.measures))
    for row in table.rows:
        about = [_cell(getattr(row, name)) for name in ABOUT]
        writer.writerow((*about, *(_cell(row.measures[name]) for name in table.measures)))
    return file.getvalue()


def _cell(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.{SIGNIFICANT}g}" if math.isfinite(value) else ""
    return str(value)


def read_table(file: Path) -> ResultTable:
    """Return the table in a file; raises BadTable."""
    try:
        lines = list(csv.reader(io.StringIO(file.read_text(encoding="utf-8-sig"))))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadTable(f"{file}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not lines or tuple(lines[0][: len(ABOUT)]) != ABOUT:
        raise BadTable(f"{file}:1: is no table of results: its first columns must be {', '.join(ABOUT)}")
    measures = tuple(lines[0][len(ABOUT) :])
    if len({*measures}) < len(measures):
        raise BadTable(f"{file}:1: a measure has two columns: leave one out")
    rows = [_row(file, number, line, measures) for number, line in enumerate(lines[1:], start=2)]
    _check_unique(file, rows)
    _check_one(file, rows)
    return ResultTable(measures, tuple(rows), str(file))


def _row(file: Path, number: int, line: Sequence[str], measures: Sequence[str]) -> ResultRow:
    if len(line) != len(ABOUT) + len(measures):
        raise BadTable(f"{file}:{number}: has {len(line)} fields, must have {len(ABOUT) + len(measures)}")
    about = dict(zip(ABOUT, line, strict=False))
    values = dict(zip(measures, line[len(ABOUT) :], strict=True))

    def finite(column: str, text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise BadTable(f"{file}:{number}: {column}: must be a number, is {text!r}")
        return value

    def whole(column: str) -> int:
        text = about[column]
        if not text.isdecimal() or len(text) > len(str(MAX_SEED)) or int(text) > MAX_SEED:
            raise BadTable(f"{file}:{number}: {column}: must be a whole number from 0 to {MAX_SEED}, is {text!r}")
        return int(text)

    return ResultRow(
        about["study"],
        about["definitions"],
        about["arm"],
        about["scenario"],
        about["use"],
        whole("seed"),
        whole("number"),
        finite("seconds", about["seconds"]),
        about["digest"],
        about["code"],
        about["versions"],
        about["renderer"],
        {name: math.nan if text == "" else finite(name, text) for name, text in values.items()},
    )


def _check_unique(file: Path, rows: Sequence[ResultRow]) -> None:
    """Refuse a run that is there twice. Where all runs have one seed, they differ by their numbers."""
    one_seed = len({row.seed for row in rows}) == 1
    seen: dict[tuple[str, int, int], int] = {}
    for number, row in enumerate(rows, start=2):
        place = (row.configuration, row.seed, row.number if one_seed else 0)
        if place in seen:
            raise BadTable(f"{file}:{number}: is the run of line {seen[place]} once more: leave one out")
        seen[place] = number


def _check_one(file: Path, rows: Sequence[ResultRow]) -> None:
    """Refuse a table of runs that cannot be compared. Runs without pictures have no renderer, and go with any."""
    known: dict[str, tuple[object, int]] = {}
    for number, row in enumerate(rows, start=2):
        for column in ("study", "definitions", "seconds", *(["renderer"] if row.renderer else [])):
            is_now = getattr(row, column)
            was, line = known.setdefault(column, (is_now, number))
            if was != is_now:
                raise BadTable(f"{file}:{number}: {column}: is {is_now!r}, in line {line} {was!r}: a table has one")
        if not 1.0 <= row.seconds <= LONGEST_RUN:
            raise BadTable(f"{file}:{number}: seconds: is {row.seconds:g}, must be from 1 to {LONGEST_RUN:g}")
