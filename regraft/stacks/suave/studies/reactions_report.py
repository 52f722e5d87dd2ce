"""The report of SUAVE's reaction times: a table by kind, one row for each reaction, and what was published."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from regraft.evaluation.reports.markdown import UNKNOWN, number, table
from regraft.evaluation.reports.sections import arms_of, costs_line, head, measures_table
from regraft.evaluation.rows import TIME, written
from regraft.evaluation.study import Report, Results, RunRecord
from regraft.stacks.suave.studies.events import KINDS
from regraft.stacks.suave.studies.measures import inspected, right_altitude, searching

MISSION: Final = {"searching (s)": searching, "right altitude": right_altitude, "inspected (m)": inspected}
PUBLISHED: Final = (
    ("none", "187.85 ± 42.40", "31.40 ± 13.00"),
    ("random", "180.15 ± 82.05", "3.88 ± 3.19"),
    ("metacontrol (MROS2)", "106.95 ± 39.46", "51.15 ± 12.01"),
)
"""Manager, search (s), distance (m): suave_missions/results/seams2023_results.csv, 20 runs each."""


def report(results: Results) -> Report:
    """Return the report of the results so far."""
    parts = [head("SUAVE: which manager answers its disturbances, and how soon?", results)]
    for key, runs in arms_of(results).runs.items():
        times = list(_reactions(runs))
        parts += [
            f"## {key}\n",
            table(
                ["disturbance", "how many", "answered", "mean reaction (s)", "longest (s)"],
                [_row(kind, runs, [seconds for _, _, each, seconds in times if each == kind]) for kind in KINDS],
            ),
        ]
    if results.runs:
        parts += ["## Search and inspection\n", measures_table(arms_of(results), MISSION)]
    parts += [
        "## Published\n",
        table(["manager", "searching (s)", "inspected (m)"], [list(each) for each in PUBLISHED]),
        "No reaction times were published with these runs. They are of Gazebo and ArduSub, by the wall clock.\n",
        "## Cost of the runs\n",
        costs_line(results) if results.runs else "No run is finished.\n",
    ]
    return Report("\n".join(parts), {"reactions.csv": _csv(results)})


def _row(kind: str, runs: Sequence[RunRecord], times: list[float]) -> list[str]:
    disturbances = sum(int(run.rows.number(f"{kind}_disturbances")[-1]) for run in runs)
    mean = number(float(np.mean(times))) if times else UNKNOWN
    return [kind, str(disturbances), str(len(times)), mean, number(max(times)) if times else UNKNOWN]


def _reactions(runs: Sequence[RunRecord]) -> Iterator[tuple[RunRecord, float, str, float]]:
    """Yield each reaction: run, the time by which it had come (s), kind, and how long it took (s).

    Rows are a second apart. Two reactions of one kind within a second have the same time, their mean.
    """
    for run in runs:
        times = run.rows.number(TIME)
        for kind in KINDS:
            count, seconds = run.rows.number(f"{kind}_reactions"), run.rows.number(f"{kind}_seconds")
            before, spent = 0.0, 0.0
            for time, many, total in zip(times, count, seconds, strict=True):
                for _ in range(round(many - before)):
                    yield run, time, kind, (total - spent) / (many - before)
                before, spent = many, total


def _csv(results: Results) -> bytes:
    """Return one line for each reaction of all runs."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["configuration", "seed", "disturbance", "answered by (s)", "reaction (s)"])
    for key, runs in arms_of(results).runs.items():
        for run, time, kind, seconds in _reactions(runs):
            writer.writerow([key, run.seed, kind, written(time), written(seconds)])
    return file.getvalue().encode()
