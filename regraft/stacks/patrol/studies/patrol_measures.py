"""The figures of one patrol, of its rows; what goes wrong when is in the rows, too."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Final

from regraft.bus_schema.model.modes.mode_parts import DEFAULT
from regraft.evaluation.reactions import Reactions, reactions
from regraft.evaluation.rows import TIME, Rows
from regraft.evaluation.study import Measure

LAP: Final = 7
"""Places of one lap."""
SAFE: Final = 0.3
"""The safety that the mission requires."""
GETS_ON: Final = 0.1
"""The performance below which a robot hardly gets on."""
THRIFTY: Final = 0.8
"""The energy that is not to be exceeded."""
LOW: Final = 0.5
"""The charge below which the battery is low."""
LASER, CAMERA, CROWD = "laser_fails", "camera_fails", "crowded"
NO_MODE: Final = "no mode"
"""No mode was entered: the stack has just begun, or a tree changes it part by part."""
REST: Final = "at rest"
SLOW: Final = 0.25
"""m/s: realizations that are safe and thrifty drive slower."""
STANDS: Final = 0.02
"""m/s below which a robot stands."""


def realizations(rows: Rows) -> list[str]:
    """Return the realization of each second, `REST` or `NO_MODE`."""
    named = {"": NO_MODE, DEFAULT: REST}
    return [named.get(name, name) for name in rows.text("realization")]


def last(rows: Rows, name: str) -> float:
    """Return the last value of a column that is not empty; NaN without any."""
    known = [value for value in rows.number(name) if not math.isnan(value)]
    return known[-1] if known else math.nan


def places(rows: Rows) -> float:
    """Return how many places were reached."""
    return last(rows, "places")


def time_to_completion(rows: Rows) -> float:
    """Return when (s) the first lap was complete; NaN where it was not."""
    done = (time for time, count in zip(rows.number(TIME), rows.number("places"), strict=True) if count >= LAP)
    return next(done, math.nan)


def share(rows: Rows, name: str, is_met: Callable[[float], bool]) -> float:
    """Return the share of the seconds with a value in which a requirement is met; NaN without any."""
    known = [value for value in rows.number(name) if not math.isnan(value)]
    return sum(map(is_met, known)) / len(known) if known else math.nan


def safe_share(rows: Rows) -> float:
    """Return the share of the time in which the true safety is at least `SAFE`."""
    return share(rows, "safety", lambda value: value >= SAFE)


def is_charged(rows: Rows) -> list[bool]:
    """Return in which seconds the battery becomes fuller: then there is nothing to drive for."""
    charges = rows.number("charge")
    return [False, *(now > before for before, now in pairwise(charges))][: len(charges)]


def charging(rows: Rows) -> float:
    """Return for how long (s) the battery was charged."""
    return float(sum(is_charged(rows)))


def standing(rows: Rows) -> float:
    """Return for how long (s) the robot stood, but for charging."""
    pairs = zip(rows.number("speed"), is_charged(rows), strict=True)
    return float(sum(speed < STANDS and not charged for speed, charged in pairs))


def performing_share(rows: Rows) -> float:
    """Return the share of the time, but for charging, in which the performance is at least `GETS_ON`."""
    pairs = zip(rows.number("performance"), is_charged(rows), strict=True)
    known = [value >= GETS_ON for value, charged in pairs if not charged and not math.isnan(value)]
    return sum(known) / len(known) if known else math.nan


def thrifty_share(rows: Rows) -> float:
    """Return the share of the time in which the energy is at most `THRIFTY`."""
    return share(rows, "energy", lambda value: value <= THRIFTY)


def requirements_met(rows: Rows) -> float:
    """Return the share of the time, but for charging, in which all three requirements are met."""
    columns = (rows.number("safety"), rows.number("performance"), rows.number("energy"), is_charged(rows))
    met = [
        safety >= SAFE and performance >= GETS_ON and energy <= THRIFTY
        for safety, performance, energy, charged in zip(*columns, strict=True)
        if not charged and not math.isnan(safety + performance + energy)
    ]
    return sum(met) / len(met) if met else math.nan


def without_design(rows: Rows) -> float:
    """Return for how long (s) no sensor that works was in use."""
    return float(sum(not works for works in _works(rows)))


def _works(rows: Rows) -> list[bool]:
    laser = [uses and not fails for uses, fails in _pairs(rows, "uses_laser", LASER)]
    camera = [uses and not fails for uses, fails in _pairs(rows, "uses_camera", CAMERA)]
    return [either or other for either, other in zip(laser, camera, strict=True)]


def _pairs(rows: Rows, uses: str, fails: str) -> Sequence[tuple[bool, bool]]:
    return list(zip(rows.is_so(uses), rows.is_so(fails), strict=True))


def lowest_charge(rows: Rows) -> float:
    """Return how full the battery was at its emptiest, as a ratio."""
    known = [value for value in rows.number("charge") if not math.isnan(value)]
    return min(known, default=math.nan)


def driven(rows: Rows) -> float:
    """Return how far (m) the robot has driven."""
    return sum(speed for speed in rows.number("speed") if not math.isnan(speed))


def driven_during(spell: str) -> Measure:
    """Return the measure: how far (m) the robot has driven while a contingency lasted."""

    def measure(rows: Rows) -> float:
        pairs = zip(rows.number("speed"), rows.is_so(spell), strict=True)
        return sum(speed for speed, lasts in pairs if lasts and not math.isnan(speed))

    return measure


def driven_when_low(rows: Rows) -> float:
    """Return how far (m) the robot has driven while its battery was low: to the dock, if it did what is asked for."""
    pairs = zip(rows.number("speed"), rows.number("charge"), strict=True)
    return sum(speed for speed, charge in pairs if charge < LOW and not math.isnan(speed))


def worst_error(rows: Rows) -> float:
    """Return the largest error (m) of the robot's believed place in seconds in which it reached a place."""
    counts, errors = rows.number("places"), rows.number("error")
    at_places = [
        error
        for before, count, error in zip(counts, counts[1:], errors[1:], strict=False)
        if count > before and not math.isnan(error)
    ]
    return max(at_places, default=math.nan)


def to_laser(rows: Rows) -> Reactions:
    """Return how soon the robot does without its laser after that has failed."""
    return reactions(rows.number(TIME), rows.is_so(LASER), [not uses for uses in rows.is_so("uses_laser")])


def to_low_battery(rows: Rows) -> Reactions:
    """Return how soon the robot may only drive slowly after its battery has become low."""
    low = [charge < LOW for charge in rows.number("charge")]
    return reactions(rows.number(TIME), low, _slow(rows))


def to_crowd(rows: Rows) -> Reactions:
    """Return how soon the robot may only drive slowly after it has come too near to a crowd."""
    disturbed, lasts = [], False
    for crowded, safety in zip(rows.is_so(CROWD), rows.number("safety"), strict=True):
        lasts = crowded and (lasts or safety < SAFE)
        disturbed.append(lasts)
    return reactions(rows.number(TIME), disturbed, _slow(rows))


def _slow(rows: Rows) -> list[bool]:
    return [velocity < SLOW for velocity in rows.number("max_velocity")]


def mean_reaction(find: Callable[[Rows], Reactions]) -> Measure:
    """Return the measure: the mean time (s) of the answers to a kind of disturbance; NaN where none was answered."""

    def measure(rows: Rows) -> float:
        answered = find(rows).answered
        return sum(answered) / len(answered) if answered else math.nan

    return measure


def _final(name: str) -> Measure:
    def measure(rows: Rows) -> float:
        return last(rows, name)

    return measure


COLUMNS: Final[dict[str, Measure]] = {
    "places": places,
    "requirements met": requirements_met,
    "safe": safe_share,
    "performing": performing_share,
    "thrifty": thrifty_share,
    "time to completion (s)": time_to_completion,
    "driven (m)": driven,
    "driven without laser (m)": driven_during(LASER),
    "driven in a crowd (m)": driven_during(CROWD),
    "driven with a low battery (m)": driven_when_low,
    "standing (s)": standing,
    "charging (s)": charging,
    "energy (J)": _final("energy_drawn"),
    "without a working design (s)": without_design,
    "lowest charge": lowest_charge,
    "contacts": _final("contacts"),
    "adaptations": _final("adaptations"),
    "taken back": _final("taken_back"),
    "worst error at a place (m)": worst_error,
    "reaction to the laser (s)": mean_reaction(to_laser),
    "reaction to a low battery (s)": mean_reaction(to_low_battery),
    "reaction to a crowd (s)": mean_reaction(to_crowd),
}
"""Every figure of a run: each has a column in the results."""
