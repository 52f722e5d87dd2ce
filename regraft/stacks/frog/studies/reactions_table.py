"""The table of reactions to disturbances in FROG's rounds."""

from __future__ import annotations

import numpy as np

from regraft.evaluation.reactions import NONE, Reactions
from regraft.evaluation.reports.markdown import UNKNOWN, table
from regraft.evaluation.reports.sections import Arms
from regraft.evaluation.study import RunRecord
from regraft.stacks.frog.studies.blocking import blocked
from regraft.stacks.frog.studies.rounds_reactions import (
    blocked_by,
    to_blocking,
    to_darkness,
    to_nearness,
)

BLOCKED = "blocked"


def reactions_table(arms: Arms) -> str:
    """Return how many disturbances of each kind were answered, and how soon."""
    rows = []
    for key, runs in arms.runs.items():
        near, dark, corner = NONE, NONE, NONE
        for run in runs:
            near, dark = near + to_nearness(run.rows), dark + to_darkness(run.rows)
            corner = corner + _to_blocking(run)
        rows.append([key, _shown(near), _shown(dark), _shown(corner)])
    text = (
        "Answered of all, and the mean time and that within which 95 % were, to the second: from when something comes "
        "near until the maximum velocity is below 0.18 m/s; from darkness until more pictures are asked for or the "
        "corner camera is used; from when that is blocked until the robot looks for itself.\n"
    )
    return f"{text}\n{table(['configuration', 'near', 'dark', 'blocked'], rows)}"


def _to_blocking(run: RunRecord) -> Reactions:
    if run.configuration.scenario != BLOCKED:
        return NONE
    return to_blocking(run.rows, blocked_by(blocked(run.seed)))


def _shown(found: Reactions) -> str:
    if not found.disturbances:
        return UNKNOWN
    answered = f"{len(found.answered)} of {found.disturbances}"
    if not found.answered:
        return answered
    return f"{answered}: {np.mean(found.answered):.1f} s, {np.quantile(found.answered, 0.95):.0f} s"
