"""Two robots in one room: equal seeds give equal runs on any hosts, and each sees the other and touches nothing."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from regraft import run_directory
from regraft.bus_schema.encoding.records import record_shape
from regraft.sim_service.devices.lidar import Lidar
from regraft.sim_service.layout.scene import load_scene
from regraft.sim_service.robots import Place, RobotSpec
from regraft.sim_service.simulation import Simulation
from regraft.stack import load
from tests.support.frog import Run, run_frog
from tests.support.hosts import JoinedHost
from tests.support.paths import TWO_ROBOTS
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

ROBOTS = ("scout", "rescuer")


SECONDS = 10
OPTIONS = ("--speed", "max", "--system", "tests")


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return a run on one host, with the stack's seed."""
    return run_frog(tmp_path_factory.mktemp("alone"), SECONDS, *OPTIONS, stack=TWO_ROBOTS)


def check(run: Run) -> None:
    """Check that a run went well, without a contact."""
    assert run.code == 0, run.errors
    assert (run.summary["contacts"], run.summary["dropped"], run.summary["reproducible"]) == (0, [], True)


def test_another_seed_gives_each_robot_another_run_and_neither_touches_anything(alone: Run, tmp_path: Path) -> None:
    other_seed = run_frog(tmp_path, SECONDS, *OPTIONS, "--seed", "2", stack=TWO_ROBOTS)
    check(alone)
    check(other_seed)
    assert other_seed.summary["digest"] != alone.summary["digest"]
    assert alone.summary["adaptations"] == {"applied": 2}
    for robot in ROBOTS:
        own = alone.summary["summaries"][f"{robot}.recorder"]
        assert own["distance"] > 1.0
        assert own["digest"] != other_seed.summary["summaries"][f"{robot}.recorder"]["digest"]


def test_equal_seeds_give_equal_runs_also_where_one_robot_is_on_a_host_of_its_own(
    alone: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    components = load(TWO_ROBOTS / "stack.yaml").architecture.components
    moved = sorted(name for name in components if name.startswith("rescuer."))
    places = [word for name in moved for word in ("--place", f"{name}=edge")]
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(run_frog, tmp_path / "home", SECONDS, *OPTIONS, "--seed", "1", *places, stack=TWO_ROBOTS)
        wait_until(lambda: running.done() or run_directory.running(), "the run to begin")
        edge = JoinedHost(run_directory.find("tests").join, "edge", tmp_path / "edge.log")
        try:
            ended = running.result()
        finally:
            assert edge.process.wait(PATIENCE) == 0
    assert f"it runs {', '.join(moved)}" in edge.log.read_text()
    check(ended)
    assert ended.summary["digest"] == alone.summary["digest"]
    for robot in ROBOTS:
        digests = {run.summary["summaries"][f"{robot}.recorder"]["digest"] for run in (alone, ended)}
        assert len(digests) == 1


@pytest.mark.evidence
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seed", range(1, 11))
def test_ten_seeds_without_a_contact(tmp_path: Path, seed: int) -> None:
    run = run_frog(tmp_path, 120, "--speed", "max", "--seed", str(seed), stack=TWO_ROBOTS, renderer="")
    assert run.code == 0, run.errors
    assert run.summary["contacts"] == 0
    for robot in ROBOTS:
        assert sum(count for place, count in run.summary["visits"].items() if place.startswith(f"{robot}/")) >= 4


DECKS = {"scout": 0.118, "rescuer": 0.155}
"""Radii (m) of what a lidar sees of each robot."""


@pytest.mark.parametrize(("observer", "other"), [ROBOTS, ROBOTS[::-1]])
@pytest.mark.parametrize("bearing", [0.0, 1.0, 2.5, -2.0])
def test_each_robot_sees_the_other_in_its_scan(observer: str, other: str, bearing: float) -> None:
    file, robots = world_and_robots()
    place = Place(1.2 * math.cos(bearing), 1.2 * math.sin(bearing), 0.7)
    placed = (replace(robots[observer], place=Place(0.0, 0.0)), replace(robots[other], place=place))
    simulation = Simulation(load_scene(file, placed), 1)
    scans = {name: simulation.robot(name).device("scan", Lidar) for name in ROBOTS}
    here, there = (scans[name].kit.data.site_xpos[scans[name].site_index][:2] for name in (observer, other))
    beam = round(math.degrees(math.atan2(there[1] - here[1], there[0] - here[0]))) % 360
    measured = scans[observer].turn().ranges[beam]
    assert measured == pytest.approx(math.dist(here, there) - DECKS[other], abs=0.04)


def world_and_robots() -> tuple[str, dict[str, RobotSpec]]:
    """Return the file of the stack's world, and its robots, each without a region."""
    parameters: dict[str, Any] = load(TWO_ROBOTS / "stack.yaml").architecture.components["world"].parameters
    shape = record_shape(RobotSpec)
    robots = (replace(shape.unpack(each), region=None) for each in parameters["robots"])
    return parameters["file"], {robot.name: robot for robot in robots}
