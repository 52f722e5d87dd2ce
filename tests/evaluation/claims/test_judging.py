"""A claim ends by one rule: it holds, is refuted, is equivalent, or nothing can be concluded yet."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.evaluation.claims.judging import Verdict, did_the_same, judge, same_by
from regraft.evaluation.claims.model import Claim, Claims, SeedSet
from regraft.evaluation.claims.power import seeds_needed
from regraft.evaluation.results.table import ResultRow, ResultTable
from regraft.evaluation.statistics.paired import Direction, SampleTest, effect

CLAIM = Claim(
    "better",
    "it is better",
    "main",
    "",
    "worth",
    "new",
    "old",
    Direction.GREATER,
    0.1,
    0.3,
    0.2,
    SampleTest.WILCOXON,
    "less",
)


def claims(*given: Claim, seeds: int = 20) -> Claims:
    uses = {SeedSet.CONFIRMATION: tuple(range(seeds))}
    return Claims("claims.yaml", "study", "plain", 0.05, 0.8, uses, given or (CLAIM,))


def table(arms: dict[str, list[float]], digests: dict[str, str] | None = None) -> ResultTable:
    def row(arm: str, seed: int, value: float) -> ResultRow:
        digest = (digests or {}).get(arm, arm) + str(seed)
        use = SeedSet.CONFIRMATION.value
        return ResultRow("study", "plain", arm, "", use, seed, 1, 9.0, digest, "c", "v", "rays", {"worth": value})

    return ResultTable(("worth",), tuple(row(arm, i, v) for arm, values in arms.items() for i, v in enumerate(values)))


def verdict(new: list[float], old: list[float], claim: Claim = CLAIM) -> Verdict:
    return judge(claims(claim), table({"new": new, "old": old}), SeedSet.CONFIRMATION)[0].verdict


NOISE = [float(x) for x in np.random.default_rng(4).normal(0.0, 0.05, 20)]
OLD = [float(x) for x in np.random.default_rng(5).normal(1.0, 1.0, 20)]


def shifted(by: float) -> list[float]:
    return [old + by + noise for old, noise in zip(OLD, NOISE, strict=True)]


def test_an_effect_worth_having_in_every_room_holds_though_rooms_differ_more() -> None:
    assert verdict(shifted(0.3), OLD) is Verdict.HOLDS


def test_an_effect_that_is_there_but_not_worth_having_is_equivalence() -> None:
    assert verdict(shifted(0.04), OLD) is Verdict.EQUIVALENT


def test_the_opposite_refutes() -> None:
    assert verdict(shifted(-0.3), OLD) is Verdict.REFUTED


def test_noise_about_the_smallest_effect_decides_nothing() -> None:
    wide = [old + 20.0 * noise for old, noise in zip(OLD, NOISE, strict=True)]
    assert verdict(wide, OLD) is Verdict.UNDECIDED


def test_fewer_than_ten_pairs_get_no_verdict_and_no_interval() -> None:
    found = judge(claims(), table({"new": shifted(0.3)[:9], "old": OLD[:9]}), SeedSet.CONFIRMATION)[0]
    assert (found.verdict, found.effect) == (Verdict.TOO_FEW, None)


def test_runs_of_other_seeds_do_not_count() -> None:
    found = judge(claims(), table({"new": shifted(0.3), "old": OLD}), SeedSet.REPORTING)[0]
    assert found.verdict is Verdict.TOO_FEW


def test_less_is_claimed_as_well_as_more() -> None:
    less = replace(CLAIM, direction=Direction.LESS)
    assert verdict(shifted(-0.3), OLD, less) is Verdict.HOLDS
    assert verdict(shifted(0.3), OLD, less) is Verdict.REFUTED


def test_equality_holds_within_the_margin_and_is_refuted_beyond_it() -> None:
    equal = replace(CLAIM, direction=Direction.EQUAL)
    assert verdict(shifted(0.02), OLD, equal) is Verdict.HOLDS
    assert verdict(shifted(0.3), OLD, equal) is Verdict.REFUTED
    assert verdict(list(OLD), OLD, equal) is Verdict.HOLDS


def test_claims_about_arms_that_did_the_same_are_one_test() -> None:
    twice = claims(CLAIM, replace(CLAIM, name="again", second="older"), replace(CLAIM, name="other", second="worse"))
    arms = {"new": shifted(0.3), "old": OLD, "older": OLD, "worse": shifted(-0.01)}
    first, again, other = judge(twice, table(arms), SeedSet.CONFIRMATION)
    assert (first.same_as, again.same_as, other.same_as) == ("", "better", "")
    assert again.p == first.p
    assert first.effect is not None
    assert first.p == pytest.approx(2.0 * first.effect.p)  # of two tests, not of three


def test_arms_that_did_the_same_are_found_by_digest_and_by_value() -> None:
    arms = {"a": [1.0, 2.0], "b": [1.0, 2.0], "c": [1.0, 2.0], "d": [1.0, 3.0]}
    found = table(arms, {"a": "same", "b": "same"})
    assert did_the_same(found, "") == [("a", "b"), ("c",), ("d",)]
    assert same_by(found, "", "worth") == [("a", "b", "c"), ("d",)]


PAIRS = st.lists(st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)), min_size=2, max_size=12)


@settings(max_examples=25, deadline=None)
@given(PAIRS)
def test_an_effect_turns_around_with_its_arms(pairs: list[tuple[float, float]]) -> None:
    one = {(seed, 0): round(first, 3) for seed, (first, _) in enumerate(pairs)}
    other = {(seed, 0): round(second, 3) for seed, (_, second) in enumerate(pairs)}
    there = effect(one, other, direction=Direction.GREATER, margin=0.1, test=SampleTest.WILCOXON)
    back = effect(other, one, direction=Direction.LESS, margin=0.1, test=SampleTest.WILCOXON)
    assert (there.difference, there.p, there.won) == (back.difference, back.p, back.won)
    assert there.low - 1e-9 <= there.difference <= there.high + 1e-9 or math.isnan(there.low)


def test_the_number_of_seeds_is_that_of_the_tests_power() -> None:
    found = claims(seeds=20)
    needed = seeds_needed(CLAIM, found)
    rng = np.random.default_rng(8)
    won = 0
    for _ in range(300):
        differences = rng.normal(CLAIM.expected, CLAIM.sd, needed)
        one = {(seed, 0): float(value) for seed, value in enumerate(differences)}
        none = dict.fromkeys(one, 0.0)
        won += effect_p(one, none) < found.alpha
    assert needed == 10  # the least that a verdict takes is more than the power needs here
    assert won / 300 > found.power


def effect_p(one: dict[tuple[int, int], float], other: dict[tuple[int, int], float]) -> float:
    from scipy.stats import wilcoxon

    return float(wilcoxon([one[p] - other[p] for p in sorted(one)], alternative="greater").pvalue)


def test_more_noise_and_more_claims_need_more_seeds() -> None:
    noisy = replace(CLAIM, sd=0.6)
    alone, many = (
        seeds_needed(noisy, claims(noisy)),
        seeds_needed(noisy, claims(*(replace(noisy, name=n) for n in "abcd"))),
    )
    assert 10 < alone < many
