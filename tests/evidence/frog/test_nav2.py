"""Ten rooms, 300 simulated seconds each: FROG drives by Nav2's default tree, arrives, and touches nothing."""

from __future__ import annotations

from typing import Any

import pytest

from tests.support.frog import run_frog
from tests.support.paths import FROG

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(3600)]

SEEDS = range(1, 11)
GOALS = {"east_boxes", "middle_box", "west_box", "hydrant"}


@pytest.fixture(scope="module")
def summaries(tmp_path_factory: pytest.TempPathFactory) -> dict[int, dict[str, Any]]:
    """Run every seed once, and print a line for each."""
    found = {}
    for seed in SEEDS:
        home = tmp_path_factory.mktemp(f"seed{seed}")
        run = run_frog(home, 300, "--speed", "max", "--seed", str(seed), stack=FROG / "nav2.yaml")
        assert run.code == 0, run.errors
        found[seed] = run.summary
        print(f"seed {seed}: { ({key: run.summary[key] for key in ('visits', 'contacts', 'real_time_factor')}) }")
    return found


def test_all_goals_are_visited_again_and_again_in_nine_of_ten(
    summaries: dict[int, dict[str, Any]],
) -> None:
    arrived = [set(each["visits"]) == GOALS and min(each["visits"].values()) >= 2 for each in summaries.values()]
    assert sum(arrived) >= 9


def test_nothing_is_touched(summaries: dict[int, dict[str, Any]]) -> None:
    assert {seed: each["contacts"] for seed, each in summaries.items() if each["contacts"]} == {}


def test_no_run_lost_a_member(summaries: dict[int, dict[str, Any]]) -> None:
    assert all(each["reproducible"] and not each["dropped"] for each in summaries.values())
