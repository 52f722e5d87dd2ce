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
    """Return how disturbances were answered; each begins where there was none the row before.

    Where the change was in effect the row before, too, there is no need. A change in the row in which the disturbance
    begins is an answer within one row.

    >>> reactions([0, 1, 2, 3, 4], [False, True, True, True, False], [False, False, False, True, False])
    Reactions(disturbances=1, answered=(2,))
    >>> reactions([0, 1, 2], [False, True, True], [False, True, True])
    Reactions(disturbances=1, answered=(0,))
    >>> reactions([0, 1, 2], [False, True, True], [True, True, True])
    Reactions(disturbances=0, answered=())
    """
    count, delays = 0, []
    since: float | None = None
    was_disturbed, was_answered = False, True
    for time, is_disturbed, is_answered in zip(times, disturbed, answered, strict=True):
        if is_disturbed and not was_disturbed and not (is_answered and was_answered):
            since, count = time, count + 1
        if since is not None and not is_disturbed:
            since = None
        if since is not None and is_answered:
            delays.append(time - since)
            since = None
        was_disturbed, was_answered = is_disturbed, is_answered
    return Reactions(count, tuple(delays))
