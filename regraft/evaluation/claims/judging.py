"""Judges claims by the runs that are there: one rule for all, the same for every study.

The difference of the means in the claim's direction is d, the smallest effect worth having is m. A family of k claims
shares its error alpha. The interval from ``low`` to ``high`` has the confidence 1 - 2 alpha / k: the family keeps alpha
whichever way its claims end. The p is corrected for all k claims (Holm 1979), also those that cannot be
judged.

- *incomplete*: a seed of the use has no run of an arm, or one that does not determine the measure.
- *too few runs*: fewer than ten seeds.
- *equivalent*: -m < low and high < m.
- *holds*: p < alpha, low > 0 and d >= m: there is an effect, and its estimate is worth having.
- *refuted*: high < m, so that an effect worth having is excluded.
- *undecided*: everything else.

A claim of equality holds by p < alpha, -m < low and high < m. It is refuted by low > m or by high < -m, and is never
equivalent. Its p is the greater one of two tests, against m and against -m.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from regraft.evaluation.claims.model import Claim, Claims, SeedSet
from regraft.evaluation.results.table import BadTable, ResultTable
from regraft.evaluation.statistics.paired import Direction, Effect, effect
from regraft.evaluation.statistics.samples import LEAST_RUNS, holm


class Verdict(Enum):
    """The end of a claim."""

    HOLDS = "holds"
    REFUTED = "refuted"
    EQUIVALENT = "equivalent"
    UNDECIDED = "undecided"
    TOO_FEW = "too few runs"
    INCOMPLETE = "incomplete"


@dataclass(frozen=True, slots=True)
class Judged:
    """A claim with its verdict; ``p`` is corrected, and ``confidence`` is that of the interval.

    ``same_as`` names an earlier claim of the family that compared the same values: its arms did the same.
    """

    claim: Claim
    verdict: Verdict
    confidence: float
    effect: Effect | None = None
    p: float = 1.0
    same_as: str = ""


def judge(claims: Claims, table: ResultTable, use: SeedSet) -> tuple[Judged, ...]:
    """Return the verdict of each claim by the runs of one use of seeds, in the claims' order.

    The use of a seed is that of the claims, not that of the table. Raises BadTable if the table lacks a measure.
    """
    seeds = claims.seeds.get(use, ())
    for claim in claims.claims:
        if claim.measure not in table.measures:
            raise BadTable(f"{table.file}: has no measure {claim.measure!r}, which {claim.name} claims something of")
    runs = table.with_seeds(seeds)
    judged: dict[str, Judged] = {}
    for family in dict.fromkeys(claim.family for claim in claims.claims):
        judged |= {each.claim.name: each for each in _family(claims, family, runs, seeds)}
    return tuple(judged[claim.name] for claim in claims.claims)


def _family(claims: Claims, family: str, runs: ResultTable, seeds: Sequence[int]) -> list[Judged]:
    found = [_measured(claim, claims, runs, seeds) for claim in claims.family(family)]
    corrected = holm({each.claim.name: each.effect.p if each.effect else 1.0 for each in found})
    judged: list[Judged] = []
    first_with: dict[Hashable, str] = {}
    for each in found:
        name = each.claim.name
        if each.effect is not None:
            same_as = first_with.setdefault(_what_was_compared(each.claim, runs), name)
            verdict = _verdict(each.claim, each.effect, corrected[name], claims.alpha)
            each = replace(each, verdict=verdict, p=corrected[name], same_as="" if same_as == name else same_as)
        judged.append(each)
    return judged


def _measured(claim: Claim, claims: Claims, runs: ResultTable, seeds: Sequence[int]) -> Judged:
    """Return a claim with its effect, or why there is none."""
    confidence = 1.0 - 2.0 * claims.alpha_of(claim)
    first, second = (runs.values(claim.scenario, arm, claim.measure) for arm in (claim.first, claim.second))
    if any({seed for seed, _ in side} != {*seeds} for side in (first, second)):
        return Judged(claim, Verdict.INCOMPLETE, confidence)
    if len(seeds) < LEAST_RUNS:
        return Judged(claim, Verdict.TOO_FEW, confidence)
    measured = effect(
        first,
        second,
        direction=claim.direction,
        margin=claim.smallest_effect,
        test=claim.test,
        confidence=confidence,
    )
    return Judged(claim, Verdict.UNDECIDED, confidence, measured)


def _what_was_compared(claim: Claim, runs: ResultTable) -> Hashable:
    """Return all that an effect depends on: equal for claims about arms that did the same."""
    sides = (runs.values(claim.scenario, arm, claim.measure) for arm in (claim.first, claim.second))
    asked = (claim.measure, claim.direction, claim.smallest_effect, claim.test)
    return (*asked, *(tuple(sorted(side.items())) for side in sides))


def _verdict(claim: Claim, measured: Effect, p: float, alpha: float) -> Verdict:
    low, high, margin = measured.low, measured.high, claim.smallest_effect
    inside = -margin < low and high < margin
    if claim.direction is Direction.EQUAL:
        outside = low > margin or high < -margin
        return Verdict.HOLDS if inside and p < alpha else Verdict.REFUTED if outside else Verdict.UNDECIDED
    if inside:
        return Verdict.EQUIVALENT
    if high < margin:
        return Verdict.REFUTED
    if p < alpha and low > 0.0 and measured.difference >= margin:
        return Verdict.HOLDS
    return Verdict.UNDECIDED


def did_the_same(table: ResultTable, scenario: str) -> list[tuple[str, ...]]:
    """Return the arms of a scenario in groups: those of one group did the same in every run, by their digests."""
    groups: dict[Hashable, list[str]] = {}
    for arm in table.arms(scenario):
        digests = tuple(sorted((place, row.digest) for place, row in table.of(scenario, arm).items()))
        groups.setdefault(digests, []).append(arm)
    return [tuple(group) for group in groups.values()]


def same_by(table: ResultTable, scenario: str, measure: str) -> list[tuple[str, ...]]:
    """Return the arms of a scenario in groups: those of one group have one value of the measure for each seed."""
    groups: dict[Hashable, list[str]] = {}
    for arm in table.arms(scenario):
        values = tuple(sorted(table.values(scenario, arm, measure).items()))
        if values:
            groups.setdefault(values, []).append(arm)
    return [tuple(group) for group in groups.values()]
