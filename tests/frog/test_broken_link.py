"""FROG's detector is on another host, and the link to it breaks again and again."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path

import pytest

from regraft import run_directory
from tests.support.frog import Run, run_frog
from tests.support.hosts import JoinedHost
from tests.support.links import Cable
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

SECONDS = 40
BETWEEN = 1.0
"""Seconds between two breaks of the link."""


@pytest.fixture
def pool() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(1) as pool:
        yield pool


def test_a_link_that_breaks_makes_the_run_slower_and_not_another_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pool: ThreadPoolExecutor
) -> None:
    options = ("--system", "tests", "--speed", "max")
    alone = run_frog(tmp_path / "alone", SECONDS, *options)
    home = tmp_path / "home"
    monkeypatch.setenv("REGRAFT_HOME", str(home))
    running = pool.submit(run_frog, home, SECONDS, *options, "--place", "detector=edge")
    wait_until(lambda: running.done() or run_directory.running(), "the run to begin")
    cable = Cable(int(run_directory.find("tests").join.rpartition(":")[2]))
    edge = JoinedHost(f"tcp/127.0.0.1:{cable.port}", "edge", tmp_path / "edge.log")
    try:
        wait_until(lambda: "has joined" in edge.log.read_text(), "edge to join")
        cuts = _cut_until(running, cable)
    finally:
        ended = running.result()
        assert edge.process.wait(PATIENCE) == 0
        cable.close()
    assert cuts > 3
    assert (ended.summary["dropped"], ended.summary["reproducible"]) == ([], True), ended.summary["causes"]
    assert ended.summary["digest"] == alone.summary["digest"]


def _cut_until(running: Future[Run], cable: Cable) -> int:
    """Cut the link now and then until a run has ended; returns how often."""
    cuts = 0
    while not wait([running], BETWEEN).done:
        cable.cut()
        cuts += 1
    return cuts
