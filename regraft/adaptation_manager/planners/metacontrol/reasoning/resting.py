"""Designs that rest: those that failed for an objective are left out for a while.

Without it, a design that promises more than it keeps is selected again as soon as its measurement is gone. A toy
case of 300 s switched 80 times by decisions from each cycle's facts alone. With this memory it switched 8 times.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge.model import is_of

FIRST: Final = 30.0
LONGEST: Final = 600.0


@dataclass(frozen=True, slots=True)
class Rest:
    """A design that rests for an objective, some seconds long, until a time of the caller's clock.

    ``blamed`` are components and qualities, by any names: when one of them recovers, the rest is over.
    """

    design: str
    objective: str
    since: float
    seconds: float
    until: float
    blamed: frozenset[str]
    why: str


class Resting:
    """Which designs rest, for which objectives, until when. All times are those of one clock, in seconds."""

    def __init__(self, first: float = FIRST, longest: float = LONGEST) -> None:
        if not 0 < first <= longest:
            raise ValueError(f"the first rest is {first} s and the longest {longest} s: must be 0 < first <= longest")
        self._first = first
        self._longest = longest
        self._rests: dict[tuple[str, str], Rest] = {}

    @classmethod
    def restored(cls, rests: Iterable[Rest], first: float = FIRST, longest: float = LONGEST) -> Resting:
        """Return what ``every`` returned of an earlier run."""
        found = cls(first, longest)
        found._rests = {(rest.design, rest.objective): rest for rest in rests}
        return found

    def every(self) -> tuple[Rest, ...]:
        """Return all rests, those that are over included: the next of the same design is longer."""
        return tuple(self._rests.values())

    def add(
        self, design: str, objective: str, now: float, blamed: Collection[str] = (), why: str = "it failed"
    ) -> Rest:
        """Let a design rest for an objective; each rest is twice as long as the one before.

        A design that already rests keeps its rest, with more to blame. After the longest rest without a failure, a
        design begins with the first rest again.
        """
        key = (design, objective)
        rest = self._rests.get(key)
        if rest is not None and now < rest.until:
            rest = Rest(design, objective, rest.since, rest.seconds, rest.until, rest.blamed | set(blamed), rest.why)
        else:
            seconds = self._first
            if rest is not None and now <= rest.until + self._longest:
                seconds = min(2 * rest.seconds, self._longest)
            rest = Rest(design, objective, now, seconds, now + seconds, frozenset(blamed), why)
        self._rests[key] = rest
        return rest

    def get(self, design: str, objective: str, now: float) -> Rest | None:
        """Return the rest of a design, None if it does not rest."""
        rest = self._rests.get((design, objective))
        return rest if rest is not None and now < rest.until else None

    def recovered(self, names: Iterable[str]) -> set[str]:
        """End the rests for which one of these components and qualities was to blame; returns their designs."""
        gone = set(names)
        over = [key for key, rest in self._rests.items() if rest.blamed & gone]
        for key in over:
            del self._rests[key]
        return {design for design, _ in over}

    def forget(self, objective: str) -> None:
        """Forget all rests of an objective that has ended, and of those that it required."""
        self._rests = {key: rest for key, rest in self._rests.items() if not is_of(rest.objective, objective)}

    def all(self, now: float) -> tuple[Rest, ...]:
        """Return the rests of now, the one that ends first at the beginning."""
        found = (rest for rest in self._rests.values() if now < rest.until)
        return tuple(sorted(found, key=lambda rest: (rest.until, rest.design, rest.objective)))
