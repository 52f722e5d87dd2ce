"""FROG's detector goes on at another host, and comes back, while it drives."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from regraft import run_directory
from tests.frog.scripted import told, with_changer
from tests.support.frog import Run, run_frog
from tests.support.hosts import JoinedHost
from tests.support.waiting import PATIENCE, wait_until


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
