"""Makes a table of results of a campaign's runs."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Callable

from regraft.evaluation.digests import adaptation_bytes
from regraft.evaluation.results.table import ResultRow, ResultTable
from regraft.evaluation.runs.run_directory import BadRun
from regraft.evaluation.study import Measure, Results, RunRecord, Study


def result_table(study: Study, results: Results, use_of: Callable[[int], str]) -> ResultTable:
    """Return a row for each finished run; ``use_of`` returns what a seed is used for, empty for nothing.

    Raises BadRun for a measure that fails.
    """
    measures = study.measures.get(results.definitions, {})
    rows = [
        ResultRow(
            study.name,
            results.definitions,
            run.configuration.name,
            run.configuration.scenario,
            use_of(run.seed),
            run.seed,
            run.number,
            run.seconds,
            digest_of(run),
            run.made_with.get("code", ""),
            run.made_with.get("versions", ""),
            str(run.closing.get("renderer") or ""),
            {name: _measured(run, name, measure) for name, measure in measures.items()},
        )
        for run in results.runs
    ]
    return ResultTable(tuple(measures), tuple(rows))


def _measured(run: RunRecord, name: str, measure: Measure) -> float:
    """Return a measure of a run; raises BadRun with both names if it cannot be worked out."""
    try:
        return measure(run.rows)
    except Exception as error:
        run_name = f"{run.configuration.key}/{run.number:03d}"
        raise BadRun(f"{run_name}: the measure {name!r} failed: {type(error).__name__}: {error}") from error


def digest_of(run: RunRecord) -> str:
    """Return the digest of all that a run's measures are made of: its rows, and its adaptations."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    names = run.rows.names()
    writer.writerow(names)
    writer.writerows(zip(*(run.rows.text(name) for name in names), strict=True))
    digest = hashlib.sha256(file.getvalue().encode())
    for report in run.adaptations:
        digest.update(adaptation_bytes(report))
    return digest.hexdigest()
