"""How soon disturbances are answered: from when one begins until a change is in effect, as in SUAVE (SEAMS 2023)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final


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
