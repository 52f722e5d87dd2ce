"""Two robots in one room: equal seeds give equal runs, each sees the other, and neither touches anything."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.encoding.records import record_shape
from regraft.sim_service.devices.lidar import Lidar
from regraft.sim_service.layout.scene import load_scene
from regraft.sim_service.robots import Place, RobotSpec
from regraft.sim_service.simulation import Simulation
from regraft.stack import load
from tests.support.frog import run_frog
from tests.support.paths import TWO_ROBOTS

ROBOTS = ("scout", "rescuer")


def test_equal_seeds_give_equal_runs_of_two_robots_without_a_contact(tmp_path: Path) -> None:
    runs = [run_frog(tmp_path, 15, "--speed", "max", "--seed", seed, stack=TWO_ROBOTS) for seed in ("1", "1", "2")]
    for run in runs:
        assert run.code == 0, run.errors
        assert (run.summary["contacts"], run.summary["dropped"], run.summary["reproducible"]) == (0, [], True)
    first, second, other_seed = (run.summary for run in runs)
    assert second["digest"] == first["digest"]
    assert other_seed["digest"] != first["digest"]
    assert first["adaptations"] == {"applied": 2}
    for robot in ROBOTS:
        own = first["summaries"][f"{robot}.recorder"]
        assert own["distance"] > 1.0
        assert own["digest"] == second["summaries"][f"{robot}.recorder"]["digest"]
        assert own["digest"] != other_seed["summaries"][f"{robot}.recorder"]["digest"]


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
