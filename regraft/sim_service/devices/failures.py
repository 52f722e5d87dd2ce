"""Sensor failures by the clock: what is to fail when.

A schedule is a text such as ``30 black, 60 none``: from 30 s on the camera's pictures are black, from 60 s on it
works again. Where a component has several sensors, each entry names one: ``30 scan silent, 45 odometry drift``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

NONE, SILENT, FROZEN, BLACK = "none", "silent", "frozen", "black"
DROPOUT, DRIFT, BIAS, NOISE, STUCK = "dropout", "drift", "bias", "noise", "stuck"

CAMERA_FAILURES = (NONE, BLACK, FROZEN, SILENT)


class ScheduleError(ValueError):
    """A schedule that cannot be read; the message names the parameter, the entry, and what would be right."""


@dataclass(frozen=True, slots=True)
class Entry:
    """From ``time`` (s) on, ``sensor`` fails in this way (``none``: works)."""

    time: float
    sensor: str
    failure: str


@dataclass(frozen=True, slots=True)
class Schedule:
    """The failures of a component's sensors, in the order of their times."""

    entries: tuple[Entry, ...] = ()

    def at(self, sensor: str, time: float) -> str:
        """Return how a sensor fails at a time (s); ``none`` before its first entry."""
        failure = NONE
        for entry in self.entries:
            # Times are sums of ticks, so that a tick can lie a rounding error before the time that is meant.
            if entry.sensor == sensor and entry.time <= time + 1e-6:
                failure = entry.failure
        return failure


def parse_schedule(text: str, failures: Mapping[str, Sequence[str]], parameter: str = "failures") -> Schedule:
    """Return the schedule in a text; ``failures`` lists, by sensor, what can happen to it.

    Entries are separated by commas. With a single sensor its name may be left out.

    Raises:
        ScheduleError: an entry is malformed, names what there is not, or comes before the entry ahead of it.
    """
    entries: list[Entry] = []
    for part in (part.strip() for part in text.split(",")):
        if not part:
            continue
        entry = _entry(part, failures, parameter)
        if entries and entry.time < entries[-1].time:
            raise ScheduleError(f"{parameter}: {part!r} comes after {entries[-1].time:g} s: put the entries in order")
        entries.append(entry)
    return Schedule(tuple(entries))


def _entry(part: str, failures: Mapping[str, Sequence[str]], parameter: str) -> Entry:
    words = part.split()
    if len(words) == 2 and len(failures) == 1:
        words.insert(1, next(iter(failures)))
    if len(words) != 3:
        raise ScheduleError(f"{parameter}: {part!r} must read {_form(failures)}")
    time = _seconds(words[0])
    if time is None:
        raise ScheduleError(f"{parameter}: {part!r} must begin with seconds of simulated time, as in {_form(failures)}")
    if words[1] not in failures:
        raise ScheduleError(f"{parameter}: {part!r} names no sensor; there are: {', '.join(failures)}")
    known = failures[words[1]]
    if words[2] not in known:
        raise ScheduleError(f"{parameter}: {part!r} must end with one of: {', '.join(known)}")
    return Entry(time, words[1], words[2])


def _seconds(word: str) -> float | None:
    try:
        time = float(word)
    except ValueError:
        return None
    return time if math.isfinite(time) and time >= 0.0 else None


def _form(failures: Mapping[str, Sequence[str]]) -> str:
    sensor, known = next(iter(failures.items()))
    named = "" if len(failures) == 1 else f"{sensor} "
    return f"'30 {named}{known[1]}'"
