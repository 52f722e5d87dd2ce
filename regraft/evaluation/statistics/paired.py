"""Statistics of differences: by how much one arm has more than another, how sure that is, and in how many rooms."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache

import numpy as np
import scipy
from numpy.typing import NDArray

Place = tuple[int, int]
"""A run's seed and, where all runs have one seed, its number."""
RESAMPLES = 5000
FLIPS = 20_000
"""Ways to flip the signs of differences that are tried, drawn at random where there are more."""


class Direction(Enum):
    """The direction of a comparison: the first arm has more of a measure than the second, or less, or as much."""

    GREATER = "greater"
    LESS = "less"
    EQUAL = "equal"


class SampleTest(Enum):
    """The test of a comparison: of the mean of differences of equal seeds, or of two independent samples."""

    SIGN_FLIP = "sign_flip"
    MANN_WHITNEY = "mann_whitney"


@dataclass(frozen=True, slots=True)
class Effect:
    """How much more the first arm has, turned so that more is what is claimed.

    ``low`` and ``high`` bound the difference of the means with some confidence (bootstrap, bias-corrected and
    accelerated; Efron 1987). ``won`` counts the pairs of equal seeds that are as claimed: for a claim of equality,
    those that differ by less than the margin. ``equal`` counts those without a difference. ``p`` is one-sided, or for
    a claim of equality the greater of both one-sided tests against the margin.
    """

    runs: int
    first: float
    second: float
    difference: float
    low: float
    high: float
    p: float
    won: int
    equal: int


def effect(
    first: Mapping[Place, float],
    second: Mapping[Place, float],
    *,
    direction: Direction,
    margin: float,
    test: SampleTest,
    confidence: float,
) -> Effect:
    """Compare two arms by the runs of equal seeds; raises ValueError if there are none."""
    places = sorted(first.keys() & second.keys())
    if not places:
        raise ValueError("the arms have no seed in common")
    one = np.asarray([first[place] for place in places])
    other = np.asarray([second[place] for place in places])
    sign = -1.0 if direction is Direction.LESS else 1.0
    differences = sign * (one - other)
    low, high = _interval(sign * one, sign * other, test, confidence)
    if direction is Direction.EQUAL:
        p = max(_p(one + margin, other, test), _p(other + margin, one, test))
    else:
        p = _p(sign * one, sign * other, test)
    return Effect(
        len(places),
        float(one.mean()),
        float(other.mean()),
        float(differences.mean()),
        low,
        high,
        p,
        int(np.count_nonzero(np.abs(differences) < margin if direction is Direction.EQUAL else differences > 0.0)),
        int(np.count_nonzero(differences == 0.0)),
    )


def _p(greater: NDArray[np.float64], less: NDArray[np.float64], test: SampleTest) -> float:
    """Return the one-sided p of ``greater`` being greater."""
    if test is SampleTest.MANN_WHITNEY:
        if np.ptp(np.concatenate([greater, less])) == 0.0:
            return 1.0
        return float(scipy.stats.mannwhitneyu(greater, less, alternative="greater").pvalue)
    differences = greater - less
    if not differences.any():
        return 1.0
    flipped = scipy.stats.permutation_test(
        (differences,),
        _mean,
        permutation_type="samples",
        vectorized=True,
        n_resamples=FLIPS,
        batch=RESAMPLES,
        alternative="greater",
        rng=np.random.default_rng(0),
    )
    return float(flipped.pvalue)


@cache
def least_p(runs: int, test: SampleTest) -> float:
    """Return the p of so many runs of each arm, where all of the first arm are greater."""
    places = np.arange(runs, dtype=np.float64)
    return _p(places + runs, places, test)


def _interval(
    one: NDArray[np.float64], other: NDArray[np.float64], test: SampleTest, confidence: float
) -> tuple[float, float]:
    paired = test is SampleTest.SIGN_FLIP
    samples: Sequence[NDArray[np.float64]] = [one - other] if paired else [one, other]
    if len(one) < 2 or all(np.ptp(sample) == 0.0 for sample in samples):
        middle = float((one - other).mean())
        return (middle, middle) if len(one) > 1 else (-math.inf, math.inf)
    found = scipy.stats.bootstrap(
        samples,
        _mean if paired else _difference,
        n_resamples=RESAMPLES,
        confidence_level=confidence,
        method="BCa",
        vectorized=True,
        rng=np.random.default_rng(0),
    ).confidence_interval
    return float(found.low), float(found.high)


def _mean(sample: NDArray[np.float64], axis: int = -1) -> NDArray[np.float64]:
    return np.asarray(sample.mean(axis=axis))


def _difference(one: NDArray[np.float64], other: NDArray[np.float64], axis: int = -1) -> NDArray[np.float64]:
    return np.asarray(one.mean(axis=axis) - other.mean(axis=axis))
