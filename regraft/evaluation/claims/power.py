"""How many seeds a claim needs, by the normal approximation of its test."""

from __future__ import annotations

import math
from statistics import NormalDist

from regraft.evaluation.claims.model import Claim, Claims, SeedSet
from regraft.evaluation.statistics.paired import Direction, SampleTest
from regraft.evaluation.statistics.samples import LEAST_RUNS

EFFICIENCY = 3.0 / math.pi
"""Of the tests of ranks, against those of means, for normal samples (Hodges and Lehmann 1956)."""


def seeds_needed(claim: Claim, claims: Claims) -> int:
    """Return the seeds with which the claim has the power that its file asks for.

    The effect is taken to be what is expected. Holm's correction is reckoned at its worst, for the least p of a family.
    """
    alpha = claims.alpha / len(claims.family(claim.family))
    normal = NormalDist()
    if claim.direction is Direction.EQUAL:
        # Both one-sided tests have to succeed (Schuirmann 1987); what is expected takes away from the margin.
        effect = claim.smallest_effect - abs(claim.expected)
        quantiles = normal.inv_cdf(1.0 - alpha) + normal.inv_cdf((1.0 + claims.power) / 2.0)
    else:
        effect = claim.expected
        quantiles = normal.inv_cdf(1.0 - alpha) + normal.inv_cdf(claims.power)
    samples = 2.0 if claim.test is SampleTest.MANN_WHITNEY else 1.0
    if claim.sd == 0.0:
        return LEAST_RUNS
    return max(LEAST_RUNS, math.ceil(samples * (quantiles * claim.sd / effect) ** 2 / EFFICIENCY))


def too_few(claim: Claim, claims: Claims) -> str:
    """Return what is wrong with the number of confirmation seeds, empty if they are enough."""
    there = len(claims.seeds.get(SeedSet.CONFIRMATION, ()))
    needed = seeds_needed(claim, claims)
    if there >= needed:
        return ""
    return f"needs {needed} confirmation seeds for a power of {claims.power:g}, there are {there}"
