"""Robots that no code knows do what FROG does, or what they were made for."""

from __future__ import annotations

import math
import os
from itertools import pairwise
from pathlib import Path

import pytest

from tests.frog.conftest import StartFrog, start_frog
from tests.robots.witness import written
from tests.support.commands import run
from tests.support.frog import run_frog

pytestmark = pytest.mark.slow

__all__ = ["start_frog"]

HERE = Path(__file__).parent
ARENA = 0.37
"""m from its middle to its walls."""
HULL, REACH = 0.037, 0.06


def make_rounds(folder: Path, seconds: float, visits: dict[str, int]) -> None:
    """Have the roller make FROG's rounds, and check how it drives, and where it has been in the end."""
    seen = folder / "seen.jsonl"
    options = ("--speed", "max", "--set", f"witness.file={seen}")
    ended = run_frog(folder, seconds, *options, renderer="ray", stack=HERE / "roller_on_rounds.yaml")
    assert ended.code == 0, ended.errors
    assert ended.summary["reproducible"] is True
    assert ended.summary["visits"] == visits
    assert ended.summary["contacts"] == 0
    speeds = [line["speed"] for line in written(seen)]
    assert 0.45 < max(speeds) < 0.52
    assert sum(speed > 0.26 for speed in speeds) > 0.3 * len(speeds)


def test_a_larger_and_faster_robot_begins_frogs_rounds_in_a_larger_room(tmp_path: Path) -> None:
    make_rounds(tmp_path, 26, {"middle_box": 1})


@pytest.mark.evidence
def test_a_larger_and_faster_robot_makes_frogs_rounds_in_a_larger_room(tmp_path: Path) -> None:
    make_rounds(tmp_path, 60, {"east_boxes": 1, "hydrant": 1, "middle_box": 1, "west_box": 1})


def test_the_robots_limit_holds_while_it_runs_and_its_data_stay_with_a_successor(start_frog: StartFrog) -> None:
    frog = start_frog(
        "--speed", "max", "--set", f"witness.file={os.devnull}", "--set", "camera.renderer=ray",
        "--set", "corner_camera.renderer=ray", stack=HERE / "roller_on_rounds.yaml",
    )  # fmt: skip
    refused = frog.rest.patch("/components/navigator/parameters", json={"max_velocity": 0.51})
    assert "0.51: must be at most 0.5 m/s" in refused.text
    pursuit = "regraft.services.navigator.pursuit_navigator:PursuitNavigator"
    answer = frog.rest.post("/components/navigator/swap", json={"class": pursuit})
    assert answer.status_code == 200, answer.text
    description = frog.client.describe("navigator")
    assert description.cls == pursuit
    fastest = description.parameter("max_velocity")
    assert fastest is not None
    assert fastest.schema["maximum"] == 0.5
    spec = frog.rest.get("/components/navigator").json()["spec"]
    assert (spec["parameters"]["radius"], spec["parameters"]["outline"]) == (0.25, [])


def test_an_epuck_follows_a_wall_for_a_lap_by_its_infrared_sensors(tmp_path: Path) -> None:
    seen = tmp_path / "seen.jsonl"
    words = ("up", str(HERE / "epuck_at_the_wall.yaml"), "--for", "60", "--speed", "max", "--headless")
    ended = run(*words, "--set", f"witness.file={seen}", environment={"REGRAFT_HOME": str(tmp_path)}, within=300.0)
    assert ended.returncode == 0, ended.stderr
    lines = written(seen)
    gaps = [ARENA - HULL - max(abs(line["x"]), abs(line["y"])) for line in lines]
    found = next(number for number, gap in enumerate(gaps) if gap < REACH)
    assert max(gaps[found:]) < REACH
    assert lines[-1]["contacts"] == 0
    bearings = [math.atan2(line["y"], line["x"]) for line in lines[found:]]
    lap = sum(math.remainder(later - earlier, math.tau) for earlier, later in pairwise(bearings))
    assert lap > math.tau
