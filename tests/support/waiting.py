"""How tests wait: for a condition, within bounds that the machine's pace stretches."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any, TypeVar

from regraft.patience import MAX_CROWDING, Patience, crowding

T = TypeVar("T")

MAX_PAUSE = 0.03
"""Seconds between two looks at what takes its time: looking costs those who are looked at."""


def slowness() -> float:
    """Return how many times longer things take here, from 1: what wants to run now, and did in the last minute."""
    lately = os.getloadavg()[0] / len(os.sched_getaffinity(0))
    return min(MAX_CROWDING, max(crowding(), lately))


SECONDS = 30.0
"""The most that anything may take while every thread that wants to run does."""
PATIENCE = SECONDS * slowness()
"""Seconds for waits that cannot look at the machine in between, as crowded as it was when the tests began."""


def wait_until(condition: Callable[[], Any], what: str = "the condition", seconds: float = SECONDS) -> None:
    """Wait for a condition, within bounds; fails the test if it does not come true."""
    wait_for(condition, what, seconds)


def wait_for(look: Callable[[], T | None], what: str, seconds: float = SECONDS) -> T:
    """Return what ``look`` finds as soon as it finds something, within bounds; fails the test if it never does."""
    patience, began = Patience(seconds), time.monotonic()
    pause = 0.002
    while not (found := look()):
        if patience.is_over():
            raise AssertionError(f"{what}: not after {time.monotonic() - began:.0f} s")
        time.sleep(pause)
        pause = min(1.2 * pause, MAX_PAUSE)
    return found
