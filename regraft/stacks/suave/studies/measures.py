"""Figures of one run of SUAVE's mission, of its rows."""

from __future__ import annotations

import math
from typing import Final

from regraft.evaluation.rows import TIME, Rows
from regraft.evaluation.study import Measure
from regraft.stacks.suave.studies.events import KINDS, expected_altitude


def searching(rows: Rows) -> float:
    """Return how long the pipeline was searched (s): the whole run where it was not found."""
    times = rows.number(TIME)
    found = (time for time, is_found in zip(times, rows.is_so("found"), strict=True) if is_found)
    return next(found, times[-1])


def right_altitude(rows: Rows) -> float:
    """Return the share of the search (s) in which the altitude is that of the visibility, NaN without a search.

    Seconds in which one sees too little for any altitude are left out.
    """
    seconds = zip(rows.is_so("found"), rows.number("visibility"), rows.number("altitude"), strict=True)
    known = [(expected_altitude(visibility), altitude) for is_found, visibility, altitude in seconds if not is_found]
    right = [altitude == expected for expected, altitude in known if expected is not None]
    return sum(right) / len(right) if right else math.nan


def inspected(rows: Rows) -> float:
    """Return the length of pipeline that was inspected (m)."""
    return rows.number("distance")[-1]


def mean_reaction(rows: Rows, *kinds: str) -> float:
    """Return the mean time of the reactions of some kinds (s), NaN where there was none."""
    count = sum(rows.number(f"{kind}_reactions")[-1] for kind in kinds)
    return sum(rows.number(f"{kind}_seconds")[-1] for kind in kinds) / count if count else math.nan


def _of_kind(kind: str) -> dict[str, Measure]:
    return {
        f"{kind} disturbances": lambda rows: rows.number(f"{kind}_disturbances")[-1],
        f"{kind} reactions": lambda rows: rows.number(f"{kind}_reactions")[-1],
        f"mean {kind} reaction (s)": lambda rows: mean_reaction(rows, kind),
    }


MEASURES: Final[dict[str, Measure]] = {
    "searching (s)": searching,
    "right altitude": right_altitude,
    "inspected (m)": inspected,
    "mean reaction (s)": lambda rows: mean_reaction(rows, *KINDS),
    **{name: measure for kind in KINDS for name, measure in _of_kind(kind).items()},
}
