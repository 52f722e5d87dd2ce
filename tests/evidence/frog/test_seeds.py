"""Ten rooms, 300 simulated seconds each: FROG visits, sees, and touches nothing."""

from __future__ import annotations

from typing import Any

import pytest

from tests.support.frog import run_frog

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(3600)]

SEEDS = range(1, 11)
GOALS = {"east_boxes", "middle_box", "west_box", "hydrant"}


@pytest.fixture(scope="module")
def summaries(tmp_path_factory: pytest.TempPathFactory) -> dict[int, dict[str, Any]]:
    """Run every seed once, and print a line for each."""
    found = {}
    for seed in SEEDS:
        run = run_frog(tmp_path_factory.mktemp(f"seed{seed}"), 300, "--speed", "max", "--seed", str(seed), renderer="")
        assert run.code == 0, run.errors
        found[seed] = run.summary
        shown = {key: run.summary[key] for key in ("visits", "contacts", "pictures", "hits", "real_time_factor")}
        print(f"seed {seed}: {shown}")
    return found


def test_all_four_goals_are_visited_again_and_again(summaries: dict[int, dict[str, Any]]) -> None:
    for seed, summary in summaries.items():
        assert set(summary["visits"]) == GOALS, seed
        assert min(summary["visits"].values()) >= 2, seed


def test_nothing_is_touched_in_at_least_nine_of_ten(summaries: dict[int, dict[str, Any]]) -> None:
    assert sum(summary["contacts"] == 0 for summary in summaries.values()) >= 9


def test_no_run_lost_a_member(summaries: dict[int, dict[str, Any]]) -> None:
    assert all(summary["reproducible"] and not summary["dropped"] for summary in summaries.values())


def test_the_hydrant_is_found_by_the_on_board_camera(summaries: dict[int, dict[str, Any]]) -> None:
    assert all(summary["hits"].get("camera", 0) > 0 for summary in summaries.values())


def test_no_two_seeds_give_the_same_digest(summaries: dict[int, dict[str, Any]]) -> None:
    assert len({summary["digest"] for summary in summaries.values()}) == len(SEEDS)
