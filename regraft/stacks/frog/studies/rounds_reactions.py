"""How soon a disturbance is answered in FROG's rounds: from when it begins until a change is in effect.

That is how SUAVE counts reaction times. A disturbance that ends before anything was changed was not answered. Rows are
a second apart, and so are the times.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from regraft.bus_schema.annotations import PlainValue
from regraft.evaluation.rows import TIME, Rows
from regraft.stacks.frog.studies.rounds_measures import OWN_TOPIC
from regraft.stacks.frog.utility import SLOW, is_near

DARK: Final = 0.70


@dataclass(frozen=True, slots=True)
class Reactions:
    """How many disturbances of a kind there were, and how long it took (s) where they were answered."""

    disturbances: int
    answered: tuple[float, ...]

    def __add__(self, other: Reactions) -> Reactions:
        """Return those of two runs."""
        return Reactions(self.disturbances + other.disturbances, self.answered + other.answered)


NONE: Final = Reactions(0, ())


def reactions(times: Sequence[float], disturbed: Sequence[bool], answered: Sequence[bool]) -> Reactions:
    """Return how disturbances were answered; each begins where there was none, or no need, the row before.

    >>> reactions([0, 1, 2, 3, 4], [False, True, True, True, False], [False, False, False, True, False])
    Reactions(disturbances=1, answered=(2,))
    """
    count, delays = 0, []
    since: float | None = None
    was_disturbed = False
    for time, is_disturbed, is_answered in zip(times, disturbed, answered, strict=True):
        if is_disturbed and not was_disturbed and not is_answered:
            since, count = time, count + 1
        if since is not None and not is_disturbed:
            since = None
        if since is not None and is_answered:
            delays.append(time - since)
            since = None
        was_disturbed = is_disturbed
    return Reactions(count, tuple(delays))


def to_nearness(rows: Rows) -> Reactions:
    """Return how soon the robot may only drive below 0.18 m/s after something has come near while it drives."""
    near = [
        driving and math.isfinite(nearest) and is_near(nearest)
        for driving, nearest in zip(rows.is_so("driving"), rows.number("nearest"), strict=True)
    ]
    return reactions(rows.number(TIME), near, [velocity < SLOW for velocity in rows.number("max_velocity")])


def to_darkness(rows: Rows) -> Reactions:
    """Return how soon more pictures are asked for, or another camera is used, after it has become dark."""
    dark = [darkness > DARK for darkness in rows.number("darkness")]
    asked, topics = rows.number("pictures_asked"), rows.text("image_topic")
    answered = [pictures > 1 or topic != OWN_TOPIC for pictures, topic in zip(asked, topics, strict=True)]
    return reactions(rows.number(TIME), dark, answered)


def to_blocking(rows: Rows, is_blocked: Callable[[float], bool]) -> Reactions:
    """Return how soon the robot looks for itself after the corner camera has been blocked."""
    times = rows.number(TIME)
    answered = [topic == OWN_TOPIC for topic in rows.text("image_topic")]
    return reactions(times, [is_blocked(time) for time in times], answered)


def blocked_by(schedule: Sequence[Mapping[str, PlainValue]]) -> Callable[[float], bool]:
    """Return whether a camera with such a schedule of failures is blocked at a time (s).

    >>> is_blocked = blocked_by([{"at": 30.0, "failure": "black"}, {"at": 60.0, "failure": "none"}])
    >>> is_blocked(29.9), is_blocked(30.0), is_blocked(60.0)
    (False, True, False)
    """

    def is_blocked(now: float) -> bool:
        states = [entry["failure"] != "none" for entry in schedule if entry["at"] <= now]
        return bool(states) and states[-1]

    return is_blocked
