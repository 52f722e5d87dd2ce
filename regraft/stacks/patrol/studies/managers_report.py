"""The report of the patrol's managers: what each kept going, at what price, and how soon it reacted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from regraft.evaluation.reactions import NONE, Reactions
from regraft.evaluation.reports.figures import illustrated
from regraft.evaluation.reports.markdown import UNKNOWN, table
from regraft.evaluation.reports.sections import Arms, adaptations_table, arms_of, costs_line, head, measures_table
from regraft.evaluation.rows import Rows
from regraft.evaluation.study import Report, Results
from regraft.stacks.patrol.studies.managers_figures import figures
from regraft.stacks.patrol.studies.patrol_measures import COLUMNS, realizations, to_crowd, to_laser, to_low_battery

KINDS: Final[dict[str, Callable[[Rows], Reactions]]] = {
    "laser fails": to_laser,
    "battery is low": to_low_battery,
    "crowd": to_crowd,
}


def report(results: Results) -> Report:
    """Return the report of the results so far."""
    arms = arms_of(results)
    parts = [head("Which manager keeps a patrol going?", results)]
    if not arms.runs:
        return Report("\n".join([*parts, "No run is finished.\n"]))
    pictures, shown = illustrated(figures(arms))
    parts += [
        measures_table(arms, COLUMNS),
        "## Designs\n",
        _designs(arms),
        "## Reactions\n",
        _reactions(arms),
        "## Adaptations\n",
        adaptations_table(arms),
        costs_line(results),
        *shown,
    ]
    return Report("\n".join(parts), pictures)


def _designs(arms: Arms) -> str:
    """Return for which share of the time each realization was in force."""
    names = sorted({name for runs in arms.runs.values() for run in runs for name in realizations(run.rows)})
    rows = []
    for key, runs in arms.runs.items():
        seconds = [name for run in runs for name in realizations(run.rows)]
        rows.append([key, *(f"{seconds.count(name) / len(seconds):.0%}" for name in names)])
    return table(["manager", *names], rows)


def _reactions(arms: Arms) -> str:
    rows = []
    for key, runs in arms.runs.items():
        cells = []
        for find in KINDS.values():
            found = NONE
            for run in runs:
                found = found + find(run.rows)
            cells.append(_shown(found))
        rows.append([key, *cells])
    text = "Answered of all, and the mean time, to the second: from the disturbance until the change is in effect.\n"
    return f"{text}\n{table(['manager', *KINDS], rows)}"


def _shown(found: Reactions) -> str:
    if not found.disturbances:
        return UNKNOWN
    answered = f"{len(found.answered)} of {found.disturbances}"
    return f"{answered}: {np.mean(found.answered):.1f} s" if found.answered else answered
