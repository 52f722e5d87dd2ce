"""Whole runs of FROG: repeatable, with an exchange that the mission does not notice, and said in one line."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.frog.changes import FEATURE, TEMPLATE, swap
from tests.frog.scripted import applied, scripted
from tests.support.frog import Run, run_frog

pytestmark = pytest.mark.slow

SECONDS = 10


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the undisturbed run."""
    return tmp_path_factory.mktemp("undisturbed")


@pytest.fixture(scope="module")
def undisturbed(home: Path) -> Run:
    """Return a run that nobody else's runs nor adaptations disturbed."""
    return run_frog(home, SECONDS, "--speed", "max")


def test_a_run_closes_with_one_object_and_equal_seeds_give_equal_digests(undisturbed: Run, tmp_path: Path) -> None:
    assert undisturbed.code == 0, undisturbed.errors
    assert undisturbed.summary["simulated_s"] == SECONDS
    assert undisturbed.summary["reproducible"] is True
    assert undisturbed.summary["contacts"] == 0
    # Two dozen processes beside each other: the second run is as the first on a machine that is busy, too.
    others = ((), ("--seed", "2"))
    with ThreadPoolExecutor(len(others)) as pool:
        runs = [
            pool.submit(run_frog, tmp_path / str(number), SECONDS, "--speed", "max", *options)
            for number, options in enumerate(others)
        ]
        second, other_seed = (run.result() for run in runs)
    assert second.summary["digest"] == undisturbed.summary["digest"], second.errors
    assert second.summary["dropped"] == []
    assert other_seed.summary["digest"] != undisturbed.summary["digest"]


def test_nothing_is_raised_in_a_run_nor_at_its_end(undisturbed: Run, home: Path) -> None:
    assert undisturbed.code == 0, undisturbed.errors
    logs = {log.stem: log.read_text() for log in (home / "frog" / "logs").glob("*.log")}
    assert "camera" in logs
    assert [name for name, text in logs.items() if "Traceback" in text] == []


def test_the_ray_camera_takes_the_pictures_of_a_run(undisturbed: Run) -> None:
    assert undisturbed.summary["renderer"] == "ray"
    assert undisturbed.summary["pictures"]


def test_the_detector_is_exchanged_while_the_mission_runs_which_does_not_notice(
    undisturbed: Run, tmp_path: Path
) -> None:
    script = [[4.0, [swap("detector", TEMPLATE)], "detect"], [7.0, [swap("detector", FEATURE)], "detect"]]
    run = applied(*scripted(tmp_path / "swapped", "stack.yaml", SECONDS, script), script)
    before = undisturbed.summary
    assert run.summary["distance"] == before["distance"]
    assert run.summary["pictures"]["camera"] == before["pictures"]["camera"] + 4
    assert run.summary["visits"] == before["visits"]
