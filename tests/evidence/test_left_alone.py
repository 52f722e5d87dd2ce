"""A robot whose mission executor is dead for good stands still at once, and stays there."""

from __future__ import annotations

import shutil
import time
from pathlib import Path

import pytest

from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.messages.sensors import Odometry
from tests.frog.conftest import StartFrog
from tests.support.frog import speed_of
from tests.support.machine.processes import kill
from tests.support.paths import FROG
from tests.support.waiting import wait_until

pytestmark = [pytest.mark.evidence, pytest.mark.alone, pytest.mark.timeout(300)]

STANDING = 0.01
"""Speed (m/s) below which the robot stands."""


@pytest.mark.parametrize("attempt", range(5))
def test_frog_stops_within_a_second_of_its_executors_death(start_frog: StartFrog, tmp_path: Path, attempt: int) -> None:
    folder = tmp_path / "frog"
    shutil.copytree(FROG, folder)
    stack = folder / "stack.yaml"
    stack.write_text(stack.read_text().replace("  bt_executor:\n", "  bt_executor:\n    restart: never\n"))
    frog = start_frog("--speed", "real", "--seed", str(attempt + 1), stack=folder)
    odometry = frog.listen("odometry", Odometry)
    wait_until(lambda: odometry and speed_of(odometry[-1].twist) > 0.2, "the robot to drive", 60.0)
    frog.wait_for_time_after(frog.clock().time, 0.3 * attempt)
    kill(frog.wait_running("bt_executor").pid)
    died, stamp = time.monotonic(), odometry[-1].stamp
    wait_until(lambda: speed_of(odometry[-1].twist) < STANDING, "the robot to stand", 20.0)
    print(f"{time.monotonic() - died:.2f} s from death to standstill, {odometry[-1].stamp - stamp:.2f} simulated")
    assert odometry[-1].stamp - stamp < 1.5
    frog.wait_for_time_after(frog.clock().time, 5.0)
    assert speed_of(odometry[-1].twist) < STANDING
    assert frog.processes()["bt_executor"].state is ProcessState.STOPPED
