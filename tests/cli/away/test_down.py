"""``regraft down`` waits for a system's end in the measure in which its host waits for the components."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from regraft import run_directory
from regraft.cli.outcomes import FAILED
from regraft.cli.system import ps
from regraft.run_directory import RunInfo
from tests.cli.conftest import Regraft

LOOKS = 10
"""Looks at the crowd that take longer than `SHORT`."""
SHORT = 0.1


@pytest.fixture
def pid() -> Iterator[int]:
    """Return a process that gets the signals in place of a system's."""
    with subprocess.Popen(["sleep", "infinity"]) as process:
        yield process.pid
        process.kill()


@pytest.fixture
def patience(monkeypatch: pytest.MonkeyPatch) -> float:
    monkeypatch.setattr(ps, "END_TIMEOUT", SHORT)
    return SHORT


@pytest.mark.usefixtures("home", "patience")
def test_a_system_that_ends_slowly_on_a_crowded_machine_is_waited_for(
    regraft: Regraft, pid: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    held = run_directory.lock("slow")
    run_directory.write_info(RunInfo("slow", "1", pid, "tcp/127.0.0.1:1", "stack.yaml", False))
    looks = 0

    def crowding() -> float:
        nonlocal looks
        looks += 1
        if looks == LOOKS:
            run_directory.unlock(held)
        return 1e6

    monkeypatch.setattr("regraft.patience.crowding", crowding)
    found = regraft("down")
    assert found.exit_code == 0, found.stderr
    assert looks == LOOKS


@pytest.mark.usefixtures("patience")
def test_a_system_that_does_not_end_is_a_failure(regraft: Regraft, home: Path, pid: int) -> None:
    with run_directory.lock("hung"):
        run_directory.write_info(RunInfo("hung", "1", pid, "tcp/127.0.0.1:1", "stack.yaml", False))
        found = regraft("down")
    assert found.exit_code == FAILED
    assert f"kill -9 {pid}" in found.stderr


@pytest.mark.usefixtures("home", "patience")
def test_a_system_that_is_started_again_at_once_has_ended(
    regraft: Regraft, pid: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    info = RunInfo("again", "1", pid, "tcp/127.0.0.1:1", "stack.yaml", False)

    def crowding() -> float:
        run_directory.write_info(replace(info, run="2"))
        return 1e6

    monkeypatch.setattr("regraft.patience.crowding", crowding)
    with run_directory.lock("again"):
        run_directory.write_info(info)
        found = regraft("down")
    assert found.exit_code == 0, found.stderr
