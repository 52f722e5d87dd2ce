"""A file of claims is read whole, or refused with every mistake, its line, and what would be right."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.evaluation.claims.model import SeedSet
from regraft.evaluation.claims.reading import read_claims
from regraft.evaluation.statistics.paired import Direction, SampleTest
from regraft.stack import StackError
from tests.evaluation.tiny import STUDY

RIGHT = """\
study: tiny
definitions: plain
alpha: 0.01
power: 0.9
seeds:
  tuning: [1001-1010]
  reporting: [1-20]
  confirmation: [4711, 30000-30018]
claims:
  faster:
    text: two at a time reach more
    family: main
    measure: reached
    first: fast
    second: slow
    smallest_effect: 1.0
    expected: 2.0
    sd: 1.0
    refuted_by: an interval that ends below one
"""


def read(tmp_path: Path, text: str = RIGHT) -> object:
    file = tmp_path / "claims.yaml"
    file.write_text(text)
    return read_claims(file, STUDY)


def test_what_a_file_gives_is_what_is_claimed(tmp_path: Path) -> None:
    file = tmp_path / "claims.yaml"
    file.write_text(RIGHT)
    found = read_claims(file, STUDY)
    assert (found.alpha, found.power, found.definitions) == (0.01, 0.9, "plain")
    assert found.seeds[SeedSet.CONFIRMATION] == (4711, *range(30000, 30019))
    assert len(found.seeds[SeedSet.REPORTING]) == 20
    (claim,) = found.claims
    assert (claim.name, claim.direction, claim.test) == ("faster", Direction.GREATER, SampleTest.SIGN_FLIP)
    assert found.set_of(1005) is SeedSet.TUNING
    assert found.set_of(5000) is None


@pytest.mark.parametrize(
    ("was", "is_now", "line", "told"),
    [
        ("study: tiny", "study: huge", 1, "these are the claims of 'tiny'"),
        ("definitions: plain", "definitions: plan", 2, "did you mean 'plain'"),
        ("alpha: 0.01", "alpha: 1", 3, "must lie between 0 and 1"),
        ("reporting: [1-20]", "reporting: [1-20, 1001]", 7, "seed 1001 is a tuning seed already"),
        ("reporting: [1-20]", "reporting: [20-1]", 7, "a range such as 1-20"),
        ("reporting: [1-20]", "reporting: 20", 7, "must be a list of seeds"),
        ("reporting: [1-20]", f"reporting: [{2**63}]", 7, "must be a seed such as 7"),
        ("reporting: [1-20]", "reporting: [0-999999999]", 7, "more than 10000 seeds"),
        ("measure: reached", "measure: reach", 13, "did you mean 'reached'"),
        ("first: fast", "first: fastest", 14, "there is no arm 'fastest'"),
        ("second: slow", "second: fast", 15, "is the first arm"),
        ("smallest_effect: 1.0", "smallest_effect: 0", 16, "must be more than 0"),
        ("expected: 2.0", "expected: 0.5", 17, "more than smallest_effect"),
        ("sd: 1.0", "sd: 40.0", 18, "confirmation seeds for a power of 0.9, there are 20"),
        ("sd: 1.0", "sd: 1e200", 18, "confirmation seeds for a power of 0.9, there are 20"),
        ("alpha: 0.01", "alpha: 1e-20", 18, "confirmation seeds for a power of 0.9, there are 20"),
        ("    refuted_by: an interval that ends below one\n", "", 10, "refuted_by: is missing"),
        ("sd: 1.0", "sd: 1.0\n    direktion: less", 19, "did you mean 'direction'"),
        ("sd: 1.0", "sd: 1.0\n    direction: more", 19, "must be one of: greater, less, equal"),
    ],
)
def test_a_mistake_is_told_with_its_line_and_what_would_be_right(
    tmp_path: Path, was: str, is_now: str, line: int, told: str
) -> None:
    with pytest.raises(StackError) as refused:
        read(tmp_path, RIGHT.replace(was, is_now))
    (problem,) = refused.value.problems
    assert problem.line == line
    assert told in str(problem)


def test_a_file_without_claims_is_none(tmp_path: Path) -> None:
    with pytest.raises(StackError, match="needs at least one"):
        read(tmp_path, RIGHT.partition("claims:")[0])


def test_seeds_by_which_no_claim_can_hold_are_refused(tmp_path: Path) -> None:
    changed = {"alpha: 0.01": "alpha: 0.0005", "[4711, 30000-30018]": "[30000-30009]", "sd: 1.0": "sd: 0.1"}
    text = RIGHT
    for was, is_now in changed.items():
        text = text.replace(was, is_now)
    with pytest.raises(StackError, match="needs 11 confirmation seeds"):
        read(tmp_path, text)
    read(tmp_path, text.replace("30000-30009", "30000-30010"))
