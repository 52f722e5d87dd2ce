"""Measures of FROG's battery while it explored."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from regraft.evaluation.rows import TIME, Rows
from regraft.evaluation.study import Measure
from regraft.stacks.frog.studies.exploring_recorder import CHARGING

LIMIT = 0.90
"""The least charge that the requirement asks for (A1)."""


@dataclass(frozen=True, slots=True)
class Violation:
    """A violation: from when on, until when, how low it was, and when charging began; None if it did not.

    ``end`` is None if the charge was not above the limit again.
    """

    start: float
    lowest: float
    charging: float | None
    end: float | None

    @property
    def is_answered(self) -> bool:
        """Whether the robot went charging, and the charge was above the limit again."""
        return self.charging is not None and self.end is not None


def violations(rows: Rows) -> list[Violation]:
    """Return the requirement's violations while the robot explores, each until the charge is above the limit again."""
    found: list[Violation] = []
    now: Violation | None = None
    columns = (rows.number(TIME), rows.number("charge"), rows.text("satisfied"), rows.text("task"))
    for time, charge, satisfied, task in zip(*columns, strict=True):
        if not math.isfinite(charge):
            continue
        if now is None and satisfied == "0":
            now = Violation(time, charge, None, None)
        if now is None:
            continue
        if charge >= LIMIT:
            found.append(Violation(now.start, now.lowest, now.charging, time))
            now = None
            continue
        charging = time if now.charging is None and task == CHARGING else now.charging
        now = Violation(now.start, min(now.lowest, charge), charging, None)
    return [*found, now] if now is not None else found


def is_kept(rows: Rows, at_least: int = 2) -> bool:
    """Return whether there were so many violations, and each was answered."""
    found = violations(rows)
    return len(found) >= at_least and all(violation.is_answered for violation in found)


def satisfied_share(rows: Rows) -> float:
    """Return the share of the seconds for which it was known that the requirement was satisfied."""
    known = [value for value in rows.number("satisfied") if math.isfinite(value)]
    return sum(known) / len(known) if known else math.nan


def finished_at(rows: Rows) -> float:
    """Return when the mission was over (s); NaN if it was not."""
    over = [t for t, task in zip(rows.number(TIME), rows.text("task"), strict=True) if task in ("succeeded", "failed")]
    return over[0] if over else math.nan


def lowest_charge(rows: Rows) -> float:
    """Return the lowest charge, in [0, 1]; NaN if it was never known."""
    return min(_known(rows, "charge"), default=math.nan)


def charging_share(rows: Rows) -> float:
    """Return the share of the seconds in which the robot went charging or charged."""
    tasks = rows.text("task")
    return sum(task == CHARGING for task in tasks) / len(tasks) if tasks else math.nan


def energy_drawn(rows: Rows) -> float:
    """Return what the robot drew (J); a row is a second."""
    return sum(_known(rows, "power"))


def energy_offered(rows: Rows) -> float:
    """Return what the charger offered (J): a full battery takes no more than is drawn."""
    return sum(_known(rows, "charger_power"))


def distance(rows: Rows) -> float:
    """Return how far the robot drove (m), from second to second."""
    places = [place for place in zip(rows.number("x"), rows.number("y"), strict=True) if math.isfinite(sum(place))]
    return sum(math.dist(one, other) for one, other in pairwise(places))


def _known(rows: Rows, name: str) -> Sequence[float]:
    return [value for value in rows.number(name) if math.isfinite(value)]


def _last(name: str) -> Measure:
    def last(rows: Rows) -> float:
        values = _known(rows, name)
        return values[-1] if values else math.nan

    return last


def _count(rows: Rows) -> float:
    return float(len(violations(rows)))


def _answered(rows: Rows) -> float:
    return float(sum(violation.is_answered for violation in violations(rows)))


COLUMNS: dict[str, Measure] = {
    "violations": _count,
    "violations answered": _answered,
    "satisfied": satisfied_share,
    "lowest charge": lowest_charge,
    "charges": _last("charges"),
    "charging": charging_share,
    "finished at (s)": finished_at,
    "frontiers left": _last("frontiers_left"),
    "energy drawn (J)": energy_drawn,
    "energy offered (J)": energy_offered,
    "distance (m)": distance,
    "contacts": _last("contacts"),
}
"""The figures of a run, by name: each is a column of the results."""
