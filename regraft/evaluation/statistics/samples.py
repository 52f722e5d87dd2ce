"""Statistics of two samples: location, whether one tends to be greater, by how much, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its part "stats" is imported by the first use: it takes longer than to start a campaign
from numpy.typing import NDArray

RESAMPLES = 2000
CONFIDENCE = 0.95
LEAST_RUNS = 10
"""Runs of an arm below which there is no interval, no effect size and no verdict."""
EXACT_UP_TO = 8
"""Samples of at most so many, without ties, have an exact p."""


@dataclass(frozen=True, slots=True)
class Summary:
    """A sample's size, mean, standard deviation (n - 1), median, and Shapiro-Wilk's p of being normal.

    A figure that so few values, or equal ones, do not determine is NaN.
    """

    size: int
    mean: float
    sd: float
    median: float
    normal_p: float


def summary(values: Sequence[float]) -> Summary:
    """Return what a sample is like; NaN among the values are left out."""
    known = np.asarray([value for value in values if math.isfinite(value)])
    size = len(known)
    if size == 0:
        return Summary(0, math.nan, math.nan, math.nan, math.nan)
    normal = math.nan
    spread = float(np.ptp(known))
    if size >= 3 and spread > 1e-12 * float(np.abs(known).max()):
        # The test does not depend on the scale, but scipy takes what is very small for all the same.
        normal = float(scipy.stats.shapiro((known - known.min()) / spread).pvalue)
    sd = float(known.std(ddof=1)) if size > 1 else math.nan
    return Summary(size, float(known.mean()), sd, float(np.median(known)), normal)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Whether ``first`` tends to be greater than ``second``: Mann and Whitney's one-sided test, and the effect.

    ``a12`` is the probability that one of the first is greater than one of the second, ties counted half. It is Vargha
    and Delaney's A, with a bootstrap interval; ``rank_biserial`` is 2 a12 - 1. ``difference`` is that of the means.
    """

    u: float
    p: float
    a12: float
    a12_low: float
    a12_high: float
    difference: float
    difference_low: float
    difference_high: float

    @property
    def rank_biserial(self) -> float:
        """Return the effect from -1 (always less) to 1 (always greater)."""
        return 2.0 * self.a12 - 1.0


def superiority(first: Sequence[float], second: Sequence[float]) -> float:
    """Return Vargha and Delaney's A: how often one of the first is greater than one of the second, ties half.

    >>> superiority([2, 3], [1, 2])
    0.875
    """
    one, other = np.asarray(first, float)[:, None], np.asarray(second, float)[None, :]
    return float(np.mean((one > other) + 0.5 * (one == other)))


def compare(first: Sequence[float], second: Sequence[float]) -> Comparison:
    """Compare two samples of at least two values; raises ValueError."""
    if min(len(first), len(second)) < 2:
        raise ValueError(f"must be two samples of at least 2 values, are of {len(first)} and {len(second)}")
    method = "exact" if max(len(first), len(second)) <= EXACT_UP_TO else "asymptotic"
    if len({*first, *second}) < len(first) + len(second):
        method = "asymptotic"
    if len({*first, *second}) == 1:
        u, p = len(first) * len(second) / 2.0, 1.0
    else:
        found = scipy.stats.mannwhitneyu(first, second, alternative="greater", method=method)
        u, p = float(found.statistic), float(found.pvalue)
    rng = np.random.default_rng(0)
    one, other = np.asarray(first, float), np.asarray(second, float)
    ones = one[rng.integers(len(one), size=(RESAMPLES, len(one)))]
    others = other[rng.integers(len(other), size=(RESAMPLES, len(other)))]
    effects = [superiority(a, b) for a, b in zip(ones, others, strict=True)]
    differences = ones.mean(axis=1) - others.mean(axis=1)
    (a12_low, a12_high), (low, high) = _inner(effects), _inner(differences)
    difference = float(one.mean() - other.mean())
    return Comparison(u, p, superiority(first, second), a12_low, a12_high, difference, low, high)


def _inner(drawn: Sequence[float] | NDArray[np.float64]) -> tuple[float, float]:
    """Return between what the inner 95 % of resampled values are."""
    low, high = np.quantile(np.asarray(drawn), ((1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0))
    return float(low), float(high)


def holm(p_values: Mapping[str, float]) -> dict[str, float]:
    """Return p values corrected for their number (Holm 1979), by name.

    >>> holm({"a": 0.01, "b": 0.04, "c": 0.03})
    {'a': 0.03, 'b': 0.06, 'c': 0.06}
    """
    corrected: dict[str, float] = {}
    so_far = 0.0
    for rank, (name, p) in enumerate(sorted(p_values.items(), key=lambda item: item[1])):
        so_far = max(so_far, min(1.0, p * (len(p_values) - rank)))
        corrected[name] = so_far
    return {name: corrected[name] for name in p_values}


def interval(values: Sequence[float]) -> tuple[float, float]:
    """Return the bootstrap interval of a mean; NaN for fewer than ten values."""
    known = np.asarray([value for value in values if math.isfinite(value)])
    if len(known) < LEAST_RUNS:
        return math.nan, math.nan
    return _inner(known[np.random.default_rng(0).integers(len(known), size=(RESAMPLES, len(known)))].mean(axis=1))
