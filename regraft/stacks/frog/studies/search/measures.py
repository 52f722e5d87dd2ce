"""Measures of FROG's search: all of the judge's verdict, which is in the last row."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from regraft.bus_schema.messages.mission import MissionState
from regraft.evaluation.rows import Rows
from regraft.evaluation.study import Measure
from regraft.stacks.frog.studies.search.recorder import VERDICT

IOU, POSE_ERROR, TARGET_ERROR, CHARGES = 0.9, 0.10, 0.3, 2
SHARE = 0.9
"""Of the rooms in which each promise must be kept."""


def verdict(rows: Rows, name: str) -> float:
    """Return a figure of the verdict, NaN if there is none."""
    values = rows.number(name) if rows.are_over else []
    return values[-1] if values else math.nan


def succeeded(rows: Rows) -> float:
    """Return whether the mission had succeeded when it was judged, as 1 or 0."""
    return float(rows.text("mission")[-1:] == [MissionState.SUCCEEDED.value])


def _named(name: str) -> Measure:
    return lambda rows: verdict(rows, name)


MEASURES: Final[dict[str, Measure]] = {"succeeded": succeeded, **{name: _named(name) for name in VERDICT}}


@dataclass(frozen=True, slots=True)
class Promise:
    """A statement that must hold in so large a share of the rooms."""

    text: str
    holds: Callable[[Rows], bool]
    share: float = SHARE


def _is_mapped(rows: Rows) -> bool:
    return (
        min(verdict(rows, "occupied_iou"), verdict(rows, "free_iou")) >= IOU
        and verdict(rows, "pose_error") <= POSE_ERROR
        and verdict(rows, "missed") == 0
        and verdict(rows, "visited") > 0
        and verdict(rows, "contacts") == 0
    )


PROMISES: Final = (
    Promise(
        f"room mapped (IoU at least {IOU:g}, a cell forgiven; pose error at most {POSE_ERROR:g} m), all goals visited, "
        "no contact",
        _is_mapped,
    ),
    Promise(f"hydrant located within {TARGET_ERROR:g} m", lambda rows: verdict(rows, "target_error") <= TARGET_ERROR),
    Promise(
        f"at least {CHARGES} charging visits while exploring",
        lambda rows: verdict(rows, "charges_exploring") >= CHARGES,
    ),
    Promise("battery never empty", lambda rows: verdict(rows, "lowest_charge") > 0.0, share=1.0),
)
