"""How soon a disturbance is answered in FROG's rounds: from when it begins until a change is in effect.

That is how SUAVE counts reaction times. A disturbance that ends before anything was changed was not answered. Rows are
a second apart, and so are the times.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from regraft.bus_schema.annotations import PlainValue
from regraft.evaluation.reactions import Reactions, reactions
from regraft.evaluation.rows import TIME, Rows
from regraft.stacks.frog.studies.rounds_measures import OWN_TOPIC
from regraft.stacks.frog.utility import SLOW, is_near

DARK: Final = 0.70


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
