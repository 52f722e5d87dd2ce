"""Measured qualities: which of them count for an objective now, and since when they break its requirements."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Objective, Quality, is_of
from regraft.bus_schema.annotations import PlainValue

MAX_RECENT = 1000
"""Measurements of one quality that are kept to look at each."""
EVERY = ""
"""In place of an objective's name: a measurement of the whole system, which counts for all objectives."""


@dataclass(frozen=True, slots=True)
class Times:
    """Times in seconds: until a design has settled, for how long a requirement is missed before it counts.

    ``stale_after`` is how old a measurement may be.
    """

    settle: float
    hold: float
    stale_after: float


@dataclass(frozen=True, slots=True)
class Measurement:
    """A measured value, and when it was measured."""

    value: float
    stamp: float


class Measurements:
    """The latest measurements of each quality, by objective. Times are seconds of the component's clock."""

    def __init__(self, memory: Mapping[str, Any] | None = None) -> None:
        """Begin, or continue from what ``remembered`` returned."""
        self._recent: dict[tuple[str, str], deque[Measurement]] = {}
        self._judged: dict[tuple[str, str], float] = {}
        self._missed: dict[tuple[str, str], float] = {}
        for objective, quality, each in (memory or {}).get("latest", ()):
            self.take(objective, quality, **each)
        for objective, quality, since in (memory or {}).get("missed", ()):
            self._missed[objective, quality] = since

    def remembered(self) -> dict[str, PlainValue]:
        """Return what a further run has to know, as plain data."""
        return {
            "latest": [[*key, asdict(recent[-1])] for key, recent in self._recent.items()],
            "missed": [[*key, since] for key, since in self._missed.items()],
        }

    def take(self, objective: str, quality: str, value: float, stamp: float) -> None:
        """Take a measurement of an objective, or of all; one that is older than the latest is left out."""
        recent = self._recent.setdefault((objective, quality), deque(maxlen=MAX_RECENT))
        if not recent or stamp >= recent[-1].stamp:
            recent.append(Measurement(value, stamp))

    def counting(
        self, objective: str, qualities: Mapping[str, object], since: float, now: float, times: Times
    ) -> dict[str, float]:
        """Return the values that count for an objective whose design is in force since a time.

        A value from before the design had settled, or a stale one, is unknown.
        """
        found: dict[str, float] = {}
        for quality in qualities:
            given = [self._recent[name, quality][-1] for name in (objective, EVERY) if (name, quality) in self._recent]
            settled = since + times.settle
            known = [each for each in given if each.stamp >= settled and now - each.stamp <= times.stale_after]
            if known:
                found[quality] = max(known, key=lambda each: each.stamp).value
        return found

    def lasting(
        self,
        objective: Objective,
        counting: Mapping[str, float],
        qualities: Mapping[str, Quality],
        since: float,
        now: float,
        times: Times,
    ) -> dict[str, float]:
        """Return the values without those that have broken a requirement of the objective for less than ``hold``.

        Its design is in force ``since`` a time. Each measurement counts, also those between two cycles.
        """
        bounds = {each.quality: each.bound for each in objective.requirements}
        found: dict[str, float] = {}
        for quality, value in counting.items():
            if quality in bounds:
                key = objective.name, quality
                self._judge(key, qualities[quality], bounds[quality], since + times.settle)
                is_missed = not qualities[quality].meets(value, bounds[quality])
                if is_missed and now - self._missed.setdefault(key, now) < times.hold:
                    continue
            found[quality] = value
        for quality in bounds.keys() - counting.keys():
            self._missed.pop((objective.name, quality), None)
        return found

    def _judge(self, key: tuple[str, str], quality: Quality, bound: float, settled: float) -> None:
        """Note since when a requirement is missed, by the measurements that have come since it was judged last."""
        objective, name = key
        begin = self._judged.get(key, -math.inf)
        every = (each for of in (objective, EVERY) for each in self._recent.get((of, name), ()))
        recent = (each for each in every if each.stamp > begin and each.stamp >= settled)
        for each in sorted(recent, key=lambda each: each.stamp):
            self._judged[key] = each.stamp
            if quality.meets(each.value, bound):
                self._missed.pop(key, None)
            else:
                self._missed.setdefault(key, each.stamp)

    def forget(self, objective: str) -> None:
        """Forget an objective whose design has changed."""
        self._keep(lambda name: name != objective)

    def forget_all_of(self, objective: str) -> None:
        """Forget an objective that is over, and what it required."""
        self._keep(lambda name: not is_of(name, objective))

    def _keep(self, is_kept: Callable[[str], bool]) -> None:
        self._recent = {key: each for key, each in self._recent.items() if is_kept(key[0])}
        self._judged = {key: stamp for key, stamp in self._judged.items() if is_kept(key[0])}
        self._missed = {key: since for key, since in self._missed.items() if is_kept(key[0])}
