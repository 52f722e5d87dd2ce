"""Judges claims by the runs that are there: one rule for all, the same for every study.

The difference of the means in the claim's direction is d, with a 95 % interval from ``low`` to ``high``. The smallest
effect worth having is m. The p is corrected for the claims of the family that are not the same (Holm 1979).

- *equivalent*: -m < low and high < m. A claim of equality holds then.
- *holds*: p < alpha, low > 0 and d >= m.
- *refuted*: high < m, so that an effect worth having is excluded. A claim of equality is refuted by low > m or by
  high < -m.
- *undecided*: everything else.
- *too few runs*: fewer than ten pairs.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from enum import Enum

from regraft.evaluation.claims.model import Claim, Claims, SeedSet
from regraft.evaluation.results.table import ResultTable
from regraft.evaluation.statistics.paired import Direction, Effect, effect
from regraft.evaluation.statistics.samples import LEAST_RUNS, holm


class Verdict(Enum):
    """The end of a claim."""

    HOLDS = "holds"
    REFUTED = "refuted"
    EQUIVALENT = "equivalent"
    UNDECIDED = "undecided"
    TOO_FEW = "too few runs"


@dataclass(frozen=True, slots=True)
class Judged:
    """A claim with its verdict; ``p`` is corrected.

    ``same_as`` names an earlier claim of the family whose two arms did the same as this one's: both are one test.
    """

    claim: Claim
    verdict: Verdict
    effect: Effect | None = None
    p: float = 1.0
    same_as: str = ""


def judge(claims: Claims, table: ResultTable, use: SeedSet) -> tuple[Judged, ...]:
    """Return the verdict of each claim by the runs of one use of seeds, in the claims' order."""
    runs = table.used_for(use.value)
    judged: dict[str, Judged] = {}
    for family in dict.fromkeys(claim.family for claim in claims.claims):
        judged |= {each.claim.name: each for each in _family(claims.family(family), runs, claims.alpha)}
    return tuple(judged[claim.name] for claim in claims.claims)


def _family(claims: tuple[Claim, ...], runs: ResultTable, alpha: float) -> list[Judged]:
    found: list[Judged] = []
    first_with: dict[Hashable, str] = {}
    for claim in claims:
        measured = _effect(claim, runs)
        if measured is None:
            found.append(Judged(claim, Verdict.TOO_FEW))
            continue
        same_as = first_with.setdefault(_what_was_compared(claim, runs), claim.name)
        found.append(Judged(claim, Verdict.UNDECIDED, measured, same_as="" if same_as == claim.name else same_as))
    corrected = holm({each.claim.name: each.effect.p for each in found if each.effect and not each.same_as})
    return [
        _decided(each, corrected[each.same_as or each.claim.name], alpha) if each.effect else each for each in found
    ]


def _effect(claim: Claim, runs: ResultTable) -> Effect | None:
    """Return the effect, None if there are too few runs for one."""
    first = runs.values(claim.scenario, claim.first, claim.measure)
    second = runs.values(claim.scenario, claim.second, claim.measure)
    if len(first.keys() & second.keys()) < LEAST_RUNS:
        return None
    return effect(first, second, direction=claim.direction, margin=claim.smallest_effect, test=claim.test)


def _what_was_compared(claim: Claim, runs: ResultTable) -> Hashable:
    """Return the values that were compared: equal for claims about arms that did the same."""
    sides = (runs.values(claim.scenario, arm, claim.measure) for arm in (claim.first, claim.second))
    return (claim.measure, claim.direction, claim.smallest_effect, *(tuple(sorted(side.items())) for side in sides))


def _decided(judged: Judged, p: float, alpha: float) -> Judged:
    assert judged.effect is not None
    low, high, margin = judged.effect.low, judged.effect.high, judged.claim.smallest_effect
    inside = -margin < low and high < margin
    if judged.claim.direction is Direction.EQUAL:
        outside = low > margin or high < -margin
        verdict = Verdict.HOLDS if inside and p < alpha else Verdict.REFUTED if outside else Verdict.UNDECIDED
    elif inside:
        verdict = Verdict.EQUIVALENT
    elif high < margin:
        verdict = Verdict.REFUTED
    elif p < alpha and low > 0.0 and judged.effect.difference >= margin:
        verdict = Verdict.HOLDS
    else:
        verdict = Verdict.UNDECIDED
    return replace(judged, verdict=verdict, p=p)


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
        groups.setdefault(values, []).append(arm)
    return [tuple(group) for group in groups.values()]
