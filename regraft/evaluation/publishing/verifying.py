"""Makes runs of a table of results again, and compares: digests, and every measure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from random import Random

from regraft.evaluation.campaign import BadCampaign, Campaign, Wanted
from regraft.evaluation.finding import find_study
from regraft.evaluation.results.recording import result_table
from regraft.evaluation.results.table import SIGNIFICANT, BadTable, ResultRow, ResultTable
from regraft.evaluation.study import Configuration, Study


class DeviationCode(Enum):
    """The difference of a run from its row."""

    FAILED = "failed"
    RENDERER = "renderer"
    DIGEST = "digest"
    MEASURE = "measure"


@dataclass(frozen=True, slots=True)
class Deviation:
    """A row that does not come out again; ``measure`` is the one that differs, empty for the run as a whole.

    ``made_with`` are the versions in which the row was made, as far as they are others: they may be the reason.
    """

    row: ResultRow
    code: DeviationCode
    text: str
    measure: str = ""
    made_with: str = ""


Say = Callable[[str], object]


def sampled(table: ResultTable, count: int, seed: int) -> tuple[ResultRow, ...]:
    """Return so many rows, drawn by ``seed``, all of them if there are no more.

    Raises BadTable if there are none, or several of one seed: a row does not hold what differs between those.
    """
    if not table.rows:
        raise BadTable(f"{table.file}: has no runs: there is nothing to make again")
    if len({(row.configuration, row.seed) for row in table.rows}) < len(table.rows):
        raise BadTable(f"{table.file}: has several runs of one seed, as --one-seed makes them: none can be made again")
    rows = Random(seed).sample(table.rows, min(count, len(table.rows)))
    return tuple(sorted(rows, key=table.rows.index))


def verify(rows: Sequence[ResultRow], folder: Path, say: Say, study: Study | None = None) -> list[Deviation]:
    """Make the runs of rows again, below ``folder``; return what differs.

    The ``study`` is found by its name in the row unless it is given.

    Raises:
        BadTable: a row names a study, definitions or an arm that there is not.
        NoSuchStudy: a study cannot be imported.
        NoRoom: the folder cannot be written.
        CodeChanged: the code changed meanwhile.
        BadRun: a run cannot be read back.
    """
    found: list[Deviation] = []
    for number, row in enumerate(rows, start=1):
        again = _made_again(row, study or _named(row), folder / f"{number:03d}")
        differing = [again] if isinstance(again, Deviation) else deviations(row, again)
        found += differing
        outcome = "; ".join(each.text for each in differing) or "equal"
        if differing and differing[0].made_with:
            outcome += f" (the table was made with {differing[0].made_with}; others may round differently)"
        say(f"{number} of {len(rows)}: {row.configuration}, seed {row.seed}: {outcome}")
    return found


def _named(row: ResultRow) -> Study:
    """Return the study that a row names; no module is imported because a table names it."""
    if ":" in row.study:
        raise BadTable(f"the study {row.study!r} is a module's: name it by --study")
    return find_study(row.study)


def _made_again(row: ResultRow, study: Study, folder: Path) -> ResultRow | Deviation:
    wanted = Wanted(study, row.definitions, (_configuration(study, row),), 1, row.seed, row.seconds)
    campaign = Campaign(wanted, folder)
    try:
        with campaign.opened(resume=False):
            campaign.run(lambda progress: None, lambda text: None)
    except BadCampaign as error:
        raise BadTable(str(error)) from None
    results = campaign.results()
    if results.failures:
        return Deviation(row, DeviationCode.FAILED, f"failed: {results.failures[0].why}")
    return result_table(study, results, lambda seed: row.use).rows[0]


def _configuration(study: Study, row: ResultRow) -> Configuration:
    for configuration in study.configurations.get(row.definitions, ()):
        if configuration.key == row.configuration:
            return configuration
    raise BadTable(f"{study.name} has no configuration {row.configuration!r} by the definitions {row.definitions!r}")


def deviations(row: ResultRow, again: ResultRow) -> list[Deviation]:
    """Return in what a run that was made again differs from its row."""
    found = []
    made_with = ", ".join(each for each in row.versions.split(", ") if each not in again.versions.split(", "))
    if again.renderer != row.renderer:
        text = f"was made with the renderer {row.renderer or 'none'}, this machine has {again.renderer or 'none'}"
        found.append(Deviation(row, DeviationCode.RENDERER, text, made_with=made_with))
    if again.digest != row.digest:
        text = f"the digest is {again.digest[:12]}, the table has {row.digest[:12]}"
        found.append(Deviation(row, DeviationCode.DIGEST, text, made_with=made_with))
    for name in dict.fromkeys((*row.measures, *again.measures)):
        was, is_now = row.measures.get(name), again.measures.get(name)
        if _shown(was) != _shown(is_now):
            text = f"{name} is {_shown(is_now)}, the table has {_shown(was)}"
            found.append(Deviation(row, DeviationCode.MEASURE, text, name, made_with))
    return found


def _shown(value: float | None) -> str:
    return "nothing" if value is None else f"{value:.{SIGNIFICANT}g}"
