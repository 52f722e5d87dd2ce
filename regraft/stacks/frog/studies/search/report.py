"""The report of FROG's search: a row for each room, and which promises are kept."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

from regraft.evaluation.reports.markdown import number, table
from regraft.evaluation.reports.sections import arms_of, costs_line, head
from regraft.evaluation.rows import Rows
from regraft.evaluation.study import Report, Results, RunRecord
from regraft.stacks.frog.studies.search.measures import MEASURES, PROMISES, Promise, verdict

COLUMNS: Final = {
    "s": "ended",
    "IoU occupied": "occupied_iou",
    "IoU free": "free_iou",
    "strict IoU occupied": "strict_occupied_iou",
    "strict IoU free": "strict_free_iou",
    "pose error m": "pose_error",
    "by the wheels m": "odometry_error",
    "worst m": "worst_pose_error",
    "contacts": "contacts",
    "hydrant error m": "target_error",
    "charges exploring": "charges_exploring",
    "charges visiting": "charges_visiting",
    "lowest charge": "lowest_charge",
}
"""The measures of a row, by their headings."""


def report(results: Results) -> Report:
    """Return the report of the results so far."""
    parts = [head("FROG: is an unknown room mapped, and the hydrant found?", results)]
    for key, runs in arms_of(results).runs.items():
        parts += [f"## {key}\n", table(["seed", *COLUMNS, "visited"], [_row(run) for run in runs])]
        parts.append(promises(runs, sum(failure.configuration.key == key for failure in results.failures)))
    parts += ["## Cost of the runs\n", costs_line(results)] if results.runs else ["No run is finished.\n"]
    return Report("\n".join(parts))


def _row(run: RunRecord) -> list[str]:
    cells = [number(MEASURES[measure](run.rows)) for measure in COLUMNS.values()]
    return [str(run.seed), *cells, _visited(run.rows)]


def _visited(rows: Rows) -> str:
    visited, missed = verdict(rows, "visited"), verdict(rows, "missed")
    return f"{visited:.0f} of {visited + missed:.0f}" if math.isfinite(visited) else number(visited)


def _counts(runs: Sequence[RunRecord], failed: int) -> Iterator[tuple[Promise, int, int]]:
    """Yield each promise with in how many rooms it is kept, and in how many it has to be; a failed run keeps none."""
    for promise in PROMISES:
        kept = sum(promise.holds(run.rows) for run in runs)
        yield promise, kept, math.ceil(promise.share * (len(runs) + failed))


def promises(runs: Sequence[RunRecord], failed: int) -> str:
    """Return in how many rooms each promise is kept, as lines."""
    total = len(runs) + failed
    lines = [
        f"- {promise.text}: {kept} of {total} ({'kept' if kept >= needed else f'BROKEN, needs {needed}'})"
        for promise, kept, needed in _counts(runs, failed)
    ]
    return "\n".join(lines) + "\n"


def are_kept(runs: Sequence[RunRecord], failed: int) -> bool:
    """Return whether all promises are kept."""
    return all(kept >= needed for _, kept, needed in _counts(runs, failed))
