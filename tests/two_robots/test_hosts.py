"""All components of one of two robots run on a host of its own: the run stays the same."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from regraft import run_directory
from regraft.stack import load
from tests.support.frog import run_frog
from tests.support.hosts import JoinedHost
from tests.support.paths import TWO_ROBOTS
from tests.support.waiting import PATIENCE, wait_until

SECONDS = 8
OPTIONS = ("--speed", "max", "--system", "tests")


def test_a_robot_on_a_host_of_its_own_does_the_same_to_the_byte(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = run_frog(tmp_path / "alone", SECONDS, *OPTIONS, stack=TWO_ROBOTS)
    components = load(TWO_ROBOTS / "stack.yaml").architecture.components
    moved = sorted(name for name in components if name.startswith("rescuer."))
    places = [word for name in moved for word in ("--place", f"{name}=edge")]
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(run_frog, tmp_path / "home", SECONDS, *OPTIONS, *places, stack=TWO_ROBOTS)
        wait_until(lambda: running.done() or run_directory.running(), "the run to begin")
        edge = JoinedHost(run_directory.find("tests").join, "edge", tmp_path / "edge.log")
        try:
            ended = running.result()
        finally:
            assert edge.process.wait(PATIENCE) == 0
    assert f"it runs {', '.join(moved)}" in edge.log.read_text()
    assert (alone.code, ended.code) == (0, 0), ended.errors
    assert (ended.summary["reproducible"], ended.summary["dropped"]) == (True, [])
    assert ended.summary["digest"] == alone.summary["digest"]
