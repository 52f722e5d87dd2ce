"""What all benchmarks share: sides measured in turns, percentiles, results, what machine this is."""

from __future__ import annotations

import math
import os
import platform
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Effort:
    """How much to measure. ``share`` scales every count: 1 is the default, the smoke test uses far less."""

    rounds: int = 5
    share: float = 1.0

    def count(self, usual: int, least: int = 1) -> int:
        """Return a count, scaled."""
        return max(least, round(usual * self.share))


@dataclass(frozen=True, slots=True)
class Result:
    """One line of the table.

    ``figure`` and ``baseline`` are in ``unit``, ``spread`` holds the least and the greatest value that single rounds
    gave for what is judged: ``ratio`` where there is a baseline, ``figure`` where there is none. ``limit`` is what it
    is judged by, from above unless ``at_least``; without a limit the line is told for information.
    """

    name: str
    figure: float
    unit: str
    baseline: float | None = None
    against: str = ""
    ratio: float | None = None
    spread: tuple[float, float] | None = None
    limit: float | None = None
    at_least: bool = False
    note: str = ""

    @property
    def judged(self) -> float:
        """What the limit is for."""
        return self.figure if self.ratio is None else self.ratio

    @property
    def within(self) -> bool | None:
        """Whether the budget is kept; None if there is none."""
        if self.limit is None or math.isnan(self.judged):
            return None if self.limit is None else False
        return self.judged >= self.limit if self.at_least else self.judged <= self.limit


@dataclass(frozen=True, slots=True)
class Sides:
    """The samples of two sides that were measured in turns, one list per round."""

    ours: list[Sequence[float]] = field(default_factory=list)
    theirs: list[Sequence[float]] = field(default_factory=list)


def in_turns(rounds: int, ours: Callable[[], Sequence[float]], theirs: Callable[[], Sequence[float]]) -> Sides:
    """Measure A B, B A, A B ...: what drifts (load, clock speed) meets both sides alike."""
    return Sides(*all_in_turns(rounds, ours, theirs))


def all_in_turns(rounds: int, *sides: Callable[[], Sequence[float]]) -> list[list[Sequence[float]]]:
    """Measure any number of sides so: forwards in one round, backwards in the next; returns the rounds of each."""
    taken: list[list[Sequence[float]]] = [[] for _ in sides]
    for number in range(rounds):
        pairs = list(zip(sides, taken, strict=True))
        for measure, samples in pairs if number % 2 == 0 else reversed(pairs):
            samples.append(measure())
    return taken


def percentile(samples: Sequence[float], share: float) -> float:
    """Return the smallest sample that at least ``share`` of all samples do not exceed; NaN without samples."""
    if not samples:
        return math.nan
    ordered = sorted(samples)
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


def compared(
    name: str,
    sides: Sides,
    unit: str,
    against: str,
    limit: float | None,
    *,
    share: float = 0.5,
    scale: float = 1.0,
    times_faster: bool = False,
    note: str = "",
) -> Result:
    """Return the result of two sides: the median over the rounds of each round's percentile, and of their ratio.

    Args:
        name: what was measured.
        sides: the samples.
        unit: of the samples times ``scale``.
        against: what the baseline is.
        limit: the greatest ratio that keeps the budget; the least one with ``times_faster``.
        share: the percentile of a round that stands for it; 0.5 is the median.
        scale: what samples are multiplied with.
        times_faster: take the ratio the other way round: how many times faster than the baseline ours is.
        note: what else to say.
    """
    ours = [percentile(samples, share) for samples in sides.ours]
    theirs = [percentile(samples, share) for samples in sides.theirs]
    pairs = list(zip(ours, theirs, strict=True))
    ratios = [other / mine if times_faster else mine / other for mine, other in pairs]
    return Result(
        name,
        statistics.median(ours) * scale,
        unit,
        statistics.median(theirs) * scale,
        against,
        statistics.median(ratios),
        (min(ratios), max(ratios)),
        limit,
        at_least=times_faster,
        note=note,
    )


def machine() -> dict[str, object]:
    """Return what the figures were taken on, and how busy it was."""
    return {
        "cores": os.cpu_count(),
        "load": [round(load, 2) for load in os.getloadavg()],
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
    }
