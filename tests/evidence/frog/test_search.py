"""FROG's search: twenty rooms, start to finish; and rooms in which a sensor fails."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.evaluation.campaign import Campaign, Wanted
from regraft.evaluation.finding import find_study
from regraft.evaluation.runs.search_run import run_search
from regraft.stacks.frog.studies.search.report import are_kept
from tests.support.paths import ROOT

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(3 * 3600)]

AT_LEAST, AT_MOST = 305.0, 900.0
"""s of simulated time that a run takes: the localization is judged at 300 s."""
STACK = ROOT / "regraft" / "stacks" / "frog" / "search.yaml"


def entries(schedule: str, device: str = "") -> str:
    """Return a schedule such as ``30 silent, 60 none`` as parameters take it, of a device of the world if named."""
    words = (entry.split() for entry in schedule.split(","))
    whose = f"device: {device}, " if device else ""
    return f"[{', '.join(f'{{at: {at}, {whose}failure: {failure}}}' for at, failure in words)}]"


FAILURES = {
    "lidar": "world.failures=" + entries("30 silent, 60 none, 150 dropout, 160 none", "scan"),
    "odometry": "world.failures=" + entries("30 silent, 45 none, 150 drift, 170 none", "odometry"),
    "camera": "camera.failures=" + entries("80 black, 200 none, 360 silent, 380 none"),
}


def test_twenty_rooms_are_searched_as_promised(tmp_path: Path) -> None:
    study = find_study("frog-search")
    campaign = Campaign(
        Wanted(study, "corrected", tuple(study.configurations["corrected"]), 20, 1, study.seconds), tmp_path, 2
    )
    with campaign.opened(resume=False):
        campaign.run(lambda progress: None, print)
    results = campaign.results()
    print(study.report(results).markdown)
    assert are_kept(results.runs, len(results.failures))


@pytest.mark.parametrize("sensor", FAILURES)
def test_a_sensor_that_fails_for_a_while_is_told_and_nothing_is_touched(sensor: str, tmp_path: Path) -> None:
    run = run_search(
        STACK, 2, tmp_path, at_least=AT_LEAST, at_most=AT_MOST, options=("--set", FAILURES[sensor])
    )  # fmt: skip
    kinds = {event.kind for event in run.events}
    assert any(kind.startswith("sensor.") or kind == "mission.trouble" for kind in kinds)
    assert run.judgement.contacts == 0
    assert run.judgement.mission in {"succeeded", "failed"}
    assert not {"component.fault", "component.restarted"} & kinds


def test_a_lidar_that_stays_away_ends_the_search_with_the_reason_and_without_a_contact(tmp_path: Path) -> None:
    failure = ("--set", "world.failures=" + entries("30 silent", "scan"))
    run = run_search(STACK, 2, tmp_path, at_least=10.0, at_most=AT_MOST, options=failure)
    assert run.judgement.mission == "failed"
    assert run.judgement.contacts == 0
    assert any("scan silent" in event.text for event in run.events if event.kind == "mission.trouble")


def test_equal_seeds_are_searched_equally(tmp_path: Path) -> None:
    first, second = (
        run_search(STACK, 4, tmp_path / str(n), at_least=AT_LEAST, at_most=AT_MOST).judgement for n in range(2)
    )
    assert first.ended == second.ended
    assert (first.visited, first.charges) == (second.visited, second.charges)
