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
from regraft.evaluation.claims.power import MORE_THAN_ANY, seeds_needed
from regraft.evaluation.results.table import ResultRow, ResultTable
from regraft.evaluation.statistics.paired import Direction, SampleTest, effect

pytestmark = pytest.mark.slow

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
    SampleTest.SIGN_FLIP,
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
    found = judge(claims(seeds=9), table({"new": shifted(0.3)[:9], "old": OLD[:9]}), SeedSet.CONFIRMATION)[0]
    assert (found.verdict, found.effect) == (Verdict.TOO_FEW, None)


def test_a_seed_without_a_run_or_without_the_measure_leaves_a_claim_incomplete() -> None:
    for new in (shifted(0.3)[:19], [*shifted(0.3)[:19], math.nan]):
        found = judge(claims(), table({"new": new, "old": OLD}), SeedSet.CONFIRMATION)[0]
        assert (found.verdict, found.effect) == (Verdict.INCOMPLETE, None)


def test_the_use_of_a_seed_is_that_of_the_claims_whatever_a_table_has() -> None:
    others = table({"new": shifted(0.3), "old": OLD})
    others = replace(others, rows=tuple(replace(row, seed=row.seed + 1000) for row in others.rows))
    assert judge(claims(), others, SeedSet.CONFIRMATION)[0].verdict is Verdict.INCOMPLETE


def test_few_rooms_that_differ_among_many_equal_ones_decide_nothing() -> None:
    few = [old + (0.9 if seed < 4 else 0.0) for seed, old in enumerate(OLD)]
    found = judge(claims(), table({"new": few, "old": OLD}), SeedSet.CONFIRMATION)[0]
    assert found.verdict is Verdict.UNDECIDED
    assert found.p == pytest.approx(1 / 16, abs=0.01)


def test_verdicts_do_not_depend_on_the_order_of_claims_nor_on_which_arms_were_run() -> None:
    ranks = replace(CLAIM, name="ranks", test=SampleTest.MANN_WHITNEY)
    unrun = replace(CLAIM, name="unrun", first="nobody")
    data = table({"new": shifted(0.3), "old": OLD})
    one, other = (judge(claims(*order), data, SeedSet.CONFIRMATION) for order in ((CLAIM, ranks), (ranks, CLAIM)))
    assert {each.claim.name: each for each in one} == {each.claim.name: each for each in other}
    assert not any(each.same_as for each in one)
    alone, with_unrun = (judge(claims(*family), data, SeedSet.CONFIRMATION)[0] for family in ((CLAIM,), (CLAIM, unrun)))
    assert with_unrun.p == pytest.approx(2.0 * alone.p)
    assert with_unrun.confidence == pytest.approx(0.95)


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


def test_equality_does_not_hold_by_the_interval_alone() -> None:
    equal = replace(CLAIM, direction=Direction.EQUAL)
    new = [0.15, 0.05, 0.1, 0.01, 0.12, 0.11, 0.03, -0.13, 0.13, 0.11]
    data = table({"new": new, "old": [0.0] * 10})
    found = judge(claims(equal, seeds=10), data, SeedSet.CONFIRMATION)[0]
    assert found.effect is not None
    assert -0.1 < found.effect.low < found.effect.high < 0.1
    assert found.p > 0.05
    assert found.verdict is Verdict.UNDECIDED
    assert judge(claims(seeds=10), data, SeedSet.CONFIRMATION)[0].verdict is Verdict.EQUIVALENT


def test_a_pair_within_the_margin_is_as_claimed_where_equality_is_claimed() -> None:
    new, old = ({(seed, 1): value for seed, value in enumerate(arm)} for arm in ([0.02, -0.02, 0.0, 0.3], [0.0] * 4))
    found = effect(new, old, direction=Direction.EQUAL, margin=0.1, test=SampleTest.SIGN_FLIP, confidence=0.95)
    assert (found.won, found.equal, found.runs) == (3, 1, 4)


def test_claims_about_arms_that_did_the_same_are_told() -> None:
    twice = claims(CLAIM, replace(CLAIM, name="again", second="older"), replace(CLAIM, name="other", second="worse"))
    arms = {"new": shifted(0.3), "old": OLD, "older": OLD, "worse": shifted(-0.01)}
    first, again, other = judge(twice, table(arms), SeedSet.CONFIRMATION)
    assert (first.same_as, again.same_as, other.same_as) == ("", "better", "")
    assert again.p == first.p
    assert first.effect is not None
    assert first.p == pytest.approx(3.0 * first.effect.p)  # a claim that is made twice is corrected for twice


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
    there = effect(one, other, direction=Direction.GREATER, margin=0.1, test=SampleTest.SIGN_FLIP, confidence=0.9)
    back = effect(other, one, direction=Direction.LESS, margin=0.1, test=SampleTest.SIGN_FLIP, confidence=0.9)
    assert (there.difference, there.p, there.won) == (back.difference, back.p, back.won)
    assert there.low - 1e-9 <= there.difference <= there.high + 1e-9 or math.isnan(there.low)


@pytest.mark.parametrize(
    "claim",
    [
        replace(CLAIM, expected=0.2, sd=0.3),
        replace(CLAIM, expected=0.12, sd=0.06),
        replace(CLAIM, direction=Direction.EQUAL, expected=0.0, sd=0.15),
    ],
    ids=["far", "near", "equal"],
)
def test_with_the_seeds_that_it_needs_a_true_claim_holds_as_often_as_promised(claim: Claim) -> None:
    needed = seeds_needed(claim, claims(claim))
    rng = np.random.default_rng(8)
    held = 0
    for _ in range(60):
        new = [float(value) for value in rng.normal(claim.expected, claim.sd, needed)]
        found = judge(claims(claim, seeds=needed), table({"new": new, "old": [0.0] * needed}), SeedSet.CONFIRMATION)
        held += found[0].verdict is Verdict.HOLDS
    assert held / 60 > 0.68  # 0.8 promised, less two standard errors of sixty


def test_more_noise_and_more_claims_need_more_seeds() -> None:
    noisy = replace(CLAIM, sd=0.6)
    alone, many = (
        seeds_needed(noisy, claims(noisy)),
        seeds_needed(noisy, claims(*(replace(noisy, name=n) for n in "abcd"))),
    )
    assert 10 < alone < many


@pytest.mark.parametrize("test", SampleTest)
@pytest.mark.parametrize("direction", [Direction.GREATER, Direction.EQUAL])
@pytest.mark.parametrize("alpha", [0.05, 0.001, 0.0005, 8e-5])
def test_the_seeds_that_a_claim_needs_decide_it_when_all_are_won_by_far(
    test: SampleTest, direction: Direction, alpha: float
) -> None:
    expected = 0.0 if direction is Direction.EQUAL else 0.3
    claim = replace(CLAIM, expected=expected, sd=0.001, test=test, direction=direction)
    needed = seeds_needed(claim, replace(claims(claim), alpha=alpha))
    new, old = ([base + seed / 1000 for seed in range(needed)] for base in (expected, 0.0))
    asked = replace(claims(claim, seeds=needed), alpha=alpha)
    found = judge(asked, table({"new": new, "old": old}), SeedSet.CONFIRMATION)
    assert found[0].verdict is Verdict.HOLDS


def test_the_claims_of_a_large_family_need_seeds_enough_for_each() -> None:
    family = [replace(CLAIM, name=str(number), sd=0.01) for number in range(52)]
    needed = seeds_needed(family[0], claims(*family))
    data = table({"new": [0.3 + seed for seed in range(needed)], "old": [float(seed) for seed in range(needed)]})
    judged = judge(claims(*family, seeds=needed), data, SeedSet.CONFIRMATION)
    assert {each.verdict for each in judged} == {Verdict.HOLDS}


def test_no_number_of_seeds_is_enough_for_an_error_that_the_test_cannot_have() -> None:
    easy = replace(CLAIM, sd=0.001)
    assert seeds_needed(easy, replace(claims(easy), alpha=4e-5)) == MORE_THAN_ANY
