"""The worth of a run of FROG's rounds: the utilities of ReBeT's evaluation, as published and corrected.

Both are computed from the same rows. *Published* follows the published analysis, faults included; *corrected* goes by
`regraft.stacks.frog.utility`, the one definition. ``docs/evaluation.md`` lists the faults.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from regraft.evaluation.rows import TIME, Rows
from regraft.services.power_model import PICTURE_ENERGY, motion_power
from regraft.stacks.frog import utility
from regraft.stacks.frog.utility import BUDGET, FASTEST, SLOW, is_near

RANGE_MIN, RANGE_MAX, NEAR = 0.12, 3.5, 0.10
DRIVING_FROM = 0.03
OWN_TOPIC = "camera/image"
SAMPLE_INTERVAL = 2.0
"""s between the samples of power that the published leg "power" adds up."""


def share_of_range(nearest: float) -> float:
    """Return a distance (m) as a share of the lidar's range, in [0, 1].

    >>> round(share_of_range(0.458), 3), share_of_range(9.0)
    (0.1, 1.0)
    """
    return min(max((nearest - RANGE_MIN) / (RANGE_MAX - RANGE_MIN), 0.0), 1.0)


@dataclass(frozen=True, slots=True)
class Drive:
    """One row of a drive: distance (m) and speed (m/s) as recorded, maximum velocity (m/s), power (W), and its leg."""

    time: float
    nearest: float
    speed: float
    speed_now: float
    max_velocity: float
    power: float
    leg: int


def drives_of(rows: Rows) -> list[Drive]:
    """Return the rows in which a drive is under way and everything is known."""
    names = (TIME, "nearest", "speed", "speed_now", "max_velocity", "motion_power", "leg")
    columns = (rows.number(name) for name in names)
    found = []
    for time, nearest, speed, speed_now, fastest, power, leg, driving in zip(
        *columns, rows.is_so("driving"), strict=True
    ):
        if driving and all(map(math.isfinite, (nearest, speed, speed_now, fastest, power))):
            found.append(Drive(time, nearest, speed, speed_now, fastest, power, int(leg)))
    return found


def legs_of(drives: Sequence[Drive]) -> dict[int, list[Drive]]:
    """Return the rows by leg."""
    found: dict[int, list[Drive]] = {}
    for drive in drives:
        found.setdefault(drive.leg, []).append(drive)
    return found


# --- visiting, corrected ---

Leg = Sequence[Drive]


def moves_safely(drive: Drive) -> bool:
    """Return whether MoveSafely is satisfied at the end of the second, where distance and speed are of one instant."""
    return utility.moves_safely(drive.nearest, drive.speed_now)


def at_most_slowly(drive: Drive) -> bool:
    """Return the same where exactly 0.18 m/s is slow, too."""
    return not is_near(drive.nearest) or drive.speed_now <= SLOW


def is_commanded_safely(drive: Drive) -> bool:
    """Return the same by the commanded maximum in place of the measured speed."""
    return not is_near(drive.nearest) or drive.max_velocity < SLOW


def moves_safely_on_average(drive: Drive) -> bool:
    """Return the same by the mean speed of the second."""
    return utility.moves_safely(drive.nearest, drive.speed)


def speed_now(drive: Drive) -> float:
    """Return the speed at the end of the second (m/s)."""
    return drive.speed_now


def mean_speed(drive: Drive) -> float:
    """Return the mean speed of the second (m/s)."""
    return drive.speed


def mean_power(leg: Leg) -> float:
    """Return a leg's mean power of the drive (W)."""
    return sum(drive.power for drive in leg) / len(leg)


def energy(leg: Leg) -> float:
    """Return a leg's energy of the drive (J); a row is a second."""
    return sum(drive.power for drive in leg)


def visiting_utility(rows: Rows) -> float:
    """Return the mean of the utility over the seconds of driving; NaN without any."""
    return _mean([utility.driving_utility(drive.nearest, drive.speed_now) for drive in drives_of(rows)])


def other_visiting_utility(
    rows: Rows,
    satisfied: Callable[[Drive], bool] = moves_safely,
    speed: Callable[[Drive], float] = speed_now,
    cost: Callable[[Leg], float] | None = None,
) -> float:
    """Return the same by other readings of MoveSafely, of v, and of W.

    W is the power at that speed, or what ``cost`` gives for the whole leg.
    """
    values = []
    for leg in legs_of(drives_of(rows)).values():
        of_leg = cost(leg) if cost else None
        for drive in leg:
            power = motion_power(speed(drive)) if of_leg is None else of_leg
            values.append(satisfied(drive) * utility.velocity_share(speed(drive)) / power)
    return _mean(values)


def safe_share(rows: Rows) -> float:
    """Return the share of the seconds of driving in which MoveSafely is satisfied; NaN without any."""
    return _mean([float(moves_safely(drive)) for drive in drives_of(rows)])


def near_share(rows: Rows) -> float:
    """Return the share of the seconds of driving in which something is near; NaN without any."""
    return _mean([float(is_near(drive.nearest)) for drive in drives_of(rows)])


# --- visiting, as published ---


@dataclass(frozen=True, slots=True)
class PublishedRow:
    """A row of the published script: everything as last measured, in any task."""

    safety: float
    efficiency: float
    leg_power: float
    max_velocity: float


def published_rows(rows: Rows) -> list[PublishedRow]:
    """Return the rows from which on everything has been measured once.

    Metrics are written every 2 s and only while driving, and keep their last value otherwise. A leg's "power" is the
    sum of a sample every 2 s, known when the leg is over.
    """
    found = []
    safety = efficiency = told = math.nan
    total, leg = 0.0, 0
    columns = zip(
        rows.number(TIME),
        rows.number("nearest"),
        rows.number("speed_now"),
        rows.number("max_velocity"),
        rows.number("leg"),
        rows.is_so("driving"),
        strict=True,
    )
    was_driving = False
    for time, nearest, speed, max_velocity, number, driving in columns:
        if was_driving and (not driving or number != leg):
            told, total = total, 0.0
        is_sampled = round(time) % round(SAMPLE_INTERVAL) == 0
        if driving and is_sampled:
            safety = share_of_range(nearest) if math.isfinite(nearest) else safety
            efficiency = min(speed / FASTEST, 1.0) if speed > DRIVING_FROM else efficiency
            total += motion_power(speed) if math.isfinite(speed) else 0.0
        leg, was_driving = int(number), driving
        if told > 0.0 and math.isfinite(safety) and math.isfinite(efficiency):
            found.append(PublishedRow(safety, efficiency, told, max_velocity))
    return found


def script_satisfied(row: PublishedRow) -> bool:
    """Return MoveSafely as the published script has it: nothing near AND slower than 0.18 m/s."""
    return row.safety > NEAR and row.efficiency * FASTEST < SLOW


def text_satisfied(row: PublishedRow) -> bool:
    """Return MoveSafely as the paper's text has it: nothing near OR a maximum velocity below 0.18 m/s."""
    return row.safety > NEAR or row.max_velocity < SLOW


def published_visiting_utility(rows: Rows, satisfied: Callable[[PublishedRow], bool] = script_satisfied) -> float:
    """Return the published U_vis."""
    return _mean([satisfied(row) * row.efficiency / row.leg_power for row in published_rows(rows)])


# --- detecting ---


def final(rows: Rows, name: str) -> float:
    """Return a counter's last value, NaN without rows."""
    values = rows.number(name)
    return values[-1] if values else math.nan


def pictures(rows: Rows) -> float:
    """Return how many pictures were looked at."""
    return final(rows, "own_pictures") + final(rows, "corner_pictures")


def hits(rows: Rows) -> float:
    """Return in how many of them the hydrant was seen."""
    return final(rows, "own_hits") + final(rows, "corner_hits")


def hits_per_picture(rows: Rows) -> float:
    """Return hits per picture; NaN without pictures."""
    return _ratio(hits(rows), pictures(rows))


def hits_per_look(rows: Rows) -> float:
    """Return hits per call of the detector, which may exceed 1; NaN without calls."""
    return _ratio(hits(rows), final(rows, "looks"))


def within_budget_share(rows: Rows) -> float:
    """Return the share of all rows in which on-board pictures have taken at most the budget (J)."""
    return _mean([float(utility.within_budget(taken)) for taken in rows.number("picture_energy")])


def detecting_utility(rows: Rows) -> float:
    """Return hits per picture times the share of the time within the budget; 0 for a run without a picture."""
    if not pictures(rows):
        return 0.0
    return utility.detecting_utility(hits_per_picture(rows), within_budget_share(rows))


def published_detecting_utility(rows: Rows) -> float:
    """Return the published U_det: hits per call, times the share of the rows on board with a budget above 0.

    The budget is the published account, which a call for n pictures costs n times too much, on whichever camera.
    """
    on_board = [topic == OWN_TOPIC for topic in rows.text("image_topic")]
    left = [BUDGET - squares * PICTURE_ENERGY for squares in rows.number("squares")]
    counted = [float(rest > 0.0) for rest, own in zip(left, on_board, strict=True) if own]
    return hits_per_look(rows) * _mean(counted)


# --- both ---


def legs_driven(rows: Rows) -> float:
    """Return how many drives to a goal were begun."""
    return final(rows, "leg")


def velocity_ratio(rows: Rows) -> float:
    """Return the mean of v/v_max over the seconds of driving."""
    return _mean([utility.velocity_share(drive.speed_now) for drive in drives_of(rows)])


def inverse_power(rows: Rows) -> float:
    """Return the mean of 1/W over the seconds of driving."""
    return _mean([1.0 / motion_power(drive.speed_now) for drive in drives_of(rows)])


def energy_driven(rows: Rows) -> float:
    """Return what driving took in all (J)."""
    return sum(energy(leg) for leg in legs_of(drives_of(rows)).values())


def published_velocity_ratio(rows: Rows) -> float:
    """Return the published mean of v/v_max: of rows as last measured."""
    return _mean([row.efficiency for row in published_rows(rows)])


def published_inverse_power(rows: Rows) -> float:
    """Return the published mean of 1/W: W is a leg's sum of samples."""
    return _mean([1.0 / row.leg_power for row in published_rows(rows)])


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else math.nan


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else math.nan
