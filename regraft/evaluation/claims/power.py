"""How many seeds a claim needs to hold, by the normal approximation of the rule that judges it."""

from __future__ import annotations

import math
from statistics import NormalDist, StatisticsError
from typing import Final

from regraft.evaluation.claims.model import Claim, Claims, SeedSet
from regraft.evaluation.statistics.paired import Direction, SampleTest, least_p
from regraft.evaluation.statistics.samples import LEAST_RUNS

EFFICIENCY = 3.0 / math.pi
"""Of the test of ranks, against that of means, for normal samples (Hodges and Lehmann 1956)."""

ENOUGH_FOR_ANY: Final = 40
"""Seeds above which the test of sign flips has no lower p: it tries a limited number of flips."""

MORE_THAN_ANY: Final = 10**12
"""The seeds that are needed where their number cannot be computed: it is larger."""


def seeds_needed(claim: Claim, claims: Claims) -> int:
    """Return the seeds with which the claim holds with the power that its file asks for.

    The effect is taken to be what is expected. Two things have to succeed: the test at the level of the family, and
    the estimate, which has to be worth having. For a claim of equality, both one-sided tests have to (Schuirmann
    1987). The samples of few seeds are not normal: seeds that are all won have to be enough for the test.
    """
    try:
        return max(_fewest(claim.test, claims.alpha_of(claim)), math.ceil(_computed(claim, claims)))
    except (OverflowError, StatisticsError):  # of a huge spread, or of an error that is too small for a float
        return MORE_THAN_ANY


def _fewest(test: SampleTest, alpha: float) -> int:
    """Return the seeds that are judged at all, and by which the test can have a p below ``alpha``."""
    enough = (runs for runs in range(LEAST_RUNS, ENOUGH_FOR_ANY + 1) if least_p(runs, test) < alpha)
    return next(enough, MORE_THAN_ANY)


def _computed(claim: Claim, claims: Claims) -> float:
    normal = NormalDist()
    level = normal.inv_cdf(1.0 - claims.alpha_of(claim))
    if claim.direction is Direction.EQUAL:
        room = claim.smallest_effect - abs(claim.expected)
        standardized = (level + normal.inv_cdf((1.0 + claims.power) / 2.0)) / room
    else:
        power = normal.inv_cdf(claims.power)
        standardized = max((level + power) / claim.expected, power / (claim.expected - claim.smallest_effect))
    samples = 2.0 / EFFICIENCY if claim.test is SampleTest.MANN_WHITNEY else 1.0
    return samples * (standardized * claim.sd) ** 2


def too_few(claim: Claim, claims: Claims) -> str:
    """Return what is wrong with the number of confirmation seeds, empty if they are enough."""
    there = len(claims.seeds.get(SeedSet.CONFIRMATION, ()))
    needed = seeds_needed(claim, claims)
    if there >= needed:
        return ""
    return f"needs {needed} confirmation seeds for a power of {claims.power:g}, there are {there}"
