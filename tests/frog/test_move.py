"""FROG's detector goes on at another host, and comes back, while it drives."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from regraft import run_directory
from regraft.bus_schema.messages.mission import MissionState, MissionStatus
from regraft.bus_schema.messages.perception import Detections
from tests.frog.scripted import told, with_changer
from tests.support.frog import Frog, Run, run_frog
from tests.support.hosts import JoinedHost
from tests.support.waiting import PATIENCE, wait_until


def test_the_detector_moves_to_a_second_host_and_back_and_the_mission_does_not_notice(
    frog: Frog, tmp_path: Path
) -> None:
    looks = frog.listen("detections", Detections)
    missions = frog.listen("mission", MissionStatus)
    edge = JoinedHost(frog.info.join, "edge", tmp_path / "edge.log")
    try:
        edge.wait_joined(frog)
        for host in ("edge", "local"):
            answer = frog.rest.post("/components/detector/move", json={"host": host})
            assert answer.status_code == 200, answer.text
            assert (answer.json()["outcome"], answer.json()["steps"][1]["state"]) == ("applied", "done")
            wait_until(lambda host=host: _host_of(frog, "detector") == host, f"the detector at {host}")  # type: ignore[misc]
            heard = len(looks)
            wait_until(lambda heard=heard: len(looks) > heard, "the detector to look again")  # type: ignore[misc]
        clock = frog.clock()
        assert (clock.reproducible, clock.dropped) == (True, ())
        assert not [one for one in missions if one.state in (MissionState.FAILED, MissionState.HALTED)]
    finally:
        assert edge.end() == 0


@pytest.mark.evidence
def test_equal_runs_with_moves_are_equal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = (_run_with_moves(tmp_path / name, monkeypatch) for name in ("one", "two"))
    assert [line.split()[1] for line in first[1] if line.startswith("adaptation")] == ["applied"] * 3
    assert first[1] == second[1]
    assert first[0].summary["reproducible"] is True, first[0].errors
    assert first[0].summary["digest"] == second[0].summary["digest"]


def _run_with_moves(folder: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Run, list[str]]:
    """Run FROG with its detector on a second host at first; returns how it ended, and what became of the moves."""
    script = [[4.0, [_move("local")], "detect"], [7.0, [_move("edge")], "detect"], [10.0, [_move("local")], ""]]
    stack = with_changer(folder, "stack.yaml", script)
    monkeypatch.setenv("REGRAFT_HOME", str(folder / "home"))
    with ThreadPoolExecutor(1) as pool:
        options = ("--speed", "max", "--system", "tests", "--place", "detector=edge")
        running = pool.submit(run_frog, folder / "home", 13, *options, stack=stack)
        wait_until(lambda: bool(run_directory.running()), "the run to begin")
        edge = JoinedHost(run_directory.find("tests").join, "edge", folder / "edge.log")
        try:
            return running.result(), told(folder / "home")
        finally:
            assert edge.process.wait(PATIENCE) == 0  # it ends with the run


def _move(host: str) -> dict[str, str]:
    return {"change": "move", "component": "detector", "host": host}


def _host_of(frog: Frog, component: str) -> str | None:
    seen = frog.client.components().get(component)
    return seen.host if seen else None
