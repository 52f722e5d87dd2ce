"""The report of evaluation A: violations of MinBattery, what followed, and the status plot."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from regraft.evaluation.reports.figures import COLOURS, illustrated
from regraft.evaluation.reports.markdown import UNKNOWN, number, table
from regraft.evaluation.reports.sections import arms_of, costs_line, head
from regraft.evaluation.rows import TIME
from regraft.evaluation.study import Report, Results, RunRecord
from regraft.stacks.frog.studies.exploring_measures import (
    LIMIT,
    Violation,
    finished_at,
    is_kept,
    lowest_charge,
    satisfied_share,
    violations,
)
from regraft.stacks.frog.studies.exploring_recorder import CHARGING, EXPLORING

NEEDED = 0.9
SATISFIED, VIOLATED = "#4c9f70", "#d1495b"


def report(results: Results) -> Report:
    """Return the report of the results so far."""
    parts = [head("FROG: does a requirement in the tree keep the battery full?", results)]
    pictures: dict[str, bytes] = {}
    for key, runs in arms_of(results).runs.items():
        kept, total = sum(is_kept(run.rows) for run in runs), len(runs)
        verdict = "kept" if kept >= NEEDED * total else "BROKEN"
        parts += [
            f"## {key}\n",
            table(
                [
                    "seed",
                    "violations",
                    "answered",
                    "from, charging, to (s)",
                    "lowest charge",
                    "satisfied",
                    "over",
                ],
                [_row(run) for run in runs],
            ),
            f"At least two violations, each followed by charging back above {LIMIT:.0%}: in {kept} of {total} runs "
            f"({verdict}: wanted in {NEEDED:.0%}).\n",
            "Published, one run: three violations; exploring until 7 s, charging until 22, exploring until 37, "
            "charging until 62, exploring until 93, charging until 123 s. There was no battery: each visit's sum of "
            "power was held against a limit.\n",
        ]
        drawn, shown = illustrated(
            {f"status_{key}.png": partial(_status, runs[0]), f"all_{key}.png": partial(_all, runs)}
        )
        pictures |= drawn
        parts += shown
    parts += ["## Cost of the runs\n", costs_line(results)] if results.runs else ["No run is finished.\n"]
    return Report("\n".join(parts), pictures)


def _row(run: RunRecord) -> list[str]:
    found = violations(run.rows)
    over = finished_at(run.rows)
    return [
        str(run.seed),
        str(len(found)),
        f"{sum(violation.is_answered for violation in found)} of {len(found)}",
        "; ".join(_times(violation) for violation in found) or UNKNOWN,
        f"{lowest_charge(run.rows):.0%}",
        f"{satisfied_share(run.rows):.0%}",
        f"{over:.0f} s" if np.isfinite(over) else "not yet",
    ]


def _times(violation: Violation) -> str:
    return ", ".join(number(each) for each in (violation.start, violation.charging, violation.end))


def _status(run: RunRecord, plot: Any) -> Any:
    """Draw the requirement's status, the current task and the charge over time, as the paper's Fig. 6 does."""
    figure, (upper, middle, lower) = plot.subplots(
        3, 1, figsize=(9, 4.6), sharex=True, height_ratios=(1, 1, 3), layout="constrained"
    )
    _bands(upper, run, 0.0)
    upper.set_yticks([0.0], ["MinBatterySystem"])
    upper.set_title(f"seed {run.seed}: green satisfied, red violated", loc="left", fontsize=9)
    times, tasks = np.asarray(run.rows.number(TIME)), np.asarray(run.rows.text("task"))
    for index, task in enumerate((EXPLORING, CHARGING)):
        middle.broken_barh([(t - 1.0, 1.0) for t in times[tasks == task]], (index - 0.4, 0.8), color=COLOURS[index * 3])
    middle.set_yticks([0, 1], [EXPLORING, CHARGING])
    lower.plot(times, run.rows.number("charge"), color=COLOURS[0])
    lower.axhline(LIMIT, color=VIOLATED, linewidth=0.8, linestyle="--")
    lower.set_ylabel("charge")
    lower.set_xlabel("simulated time (s)")
    lower.grid(linewidth=0.4, alpha=0.6)
    return figure


def _all(runs: Sequence[RunRecord], plot: Any) -> Any:
    """Draw the requirement's status in all runs, and above each when the robot charges."""
    figure, axes = plot.subplots(figsize=(9, 0.8 + 0.32 * len(runs)), layout="constrained")
    for row, run in enumerate(runs):
        _bands(axes, run, float(row))
        times, tasks = np.asarray(run.rows.number(TIME)), np.asarray(run.rows.text("task"))
        bars = [(t - 1.0, 1.0) for t in times[tasks == CHARGING]]
        axes.broken_barh(bars, (row - 0.4, 0.2), color=COLOURS[3])
    axes.set_yticks(range(len(runs)), [f"seed {run.seed}" for run in runs])
    axes.invert_yaxis()
    axes.set_xlabel("simulated time (s); green satisfied, red violated, brown charging")
    return figure


def _bands(axes: Any, run: RunRecord, row: float) -> None:
    times, satisfied = np.asarray(run.rows.number(TIME)), np.asarray(run.rows.number("satisfied"))
    for wanted, colour in ((1.0, SATISFIED), (0.0, VIOLATED)):
        axes.broken_barh([(t - 1.0, 1.0) for t in times[satisfied == wanted]], (row - 0.4, 0.8), color=colour)
