"""FROG outlives the death of any of its parts."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Iterator

import pytest

from regraft.bus_schema.messages.mission import MissionRequest, MissionState, MissionStatus
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.messages.sensors import Odometry
from tests.support.frog import Frog, speed_of
from tests.support.machine.processes import children_of, kill, stop, wait_gone
from tests.support.systems import home
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def frog(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Frog]:
    """Return FROG, running as fast as it can, of which every part may have been killed before."""
    folder = tmp_path_factory.mktemp("frog")
    with home(folder / "home"):
        frog = Frog(folder, "--speed", "max")
        yield frog
        frog.end()


def _drives(frog: Frog) -> None:
    """Wait until the robot drives and the mission runs."""
    odometry = frog.listen("odometry", Odometry)
    wait_until(lambda: any(speed_of(o.twist) > 0.2 for o in odometry), "the robot to drive", 60.0)

    def runs() -> bool:
        status = frog.client.call("mission/status", MissionRequest(), MissionStatus, 10.0)
        return status.state is MissionState.RUNNING

    wait_until(runs, "the mission to run")


def test_a_stopped_component_is_found_and_the_run_is_marked(frog: Frog) -> None:
    _drives(frog)
    assert frog.clock().reproducible
    stop(frog.wait_running("detector").pid)
    assert "hung" in frog.wait_running("detector", 2).exit_reason
    wait_until(lambda: not frog.clock().reproducible)
    assert frog.clock().dropped == ("detector",)
    _drives(frog)


def test_in_simulated_time_all_processes_are_batch_work(frog: Frog) -> None:
    policies = {name: os.sched_getscheduler(process.pid) for name, process in frog.processes().items()}
    assert set(policies.values()) == {os.SCHED_BATCH}, policies


def test_every_component_may_be_killed_in_turn_and_the_mission_goes_on(frog: Frog) -> None:
    _drives(frog)
    for name in sorted(frog.processes()):
        before = frog.wait_running(name)
        told = frog.clock().time
        restarts = len(frog.said("component.restarted", name))
        kill(before.pid)
        after = frog.wait_running(name, before.incarnation + 1)
        assert after.pid != before.pid
        assert len(frog.said("component.restarted", name)) == restarts + 1
        wait_until(lambda: frog.states() == {"active"}, f"everybody active after the death of {name}")
        frog.wait_for_time_after(told, 2.0)
        _drives(frog)
    assert not any(process.state is ProcessState.QUARANTINED for process in frog.processes().values())
    wait_until(lambda: frog.rest.get("/system").status_code == 200, "the gateway")


def test_time_never_goes_back_when_the_world_dies(frog: Frog) -> None:
    odometry = frog.listen("odometry", Odometry)
    times: list[ClockTime] = []
    for _ in range(3):
        frog.wait_for_time(3.0)
        before = frog.wait_running("world")
        kill(before.pid)
        frog.wait_running("world", before.incarnation + 1)
        times.append(frog.clock())
    frog.wait_for_time(5.0)
    stamps = [o.stamp for o in odometry]
    assert stamps == sorted(stamps)
    jumps = [math.hypot(a.pose.x - b.pose.x, a.pose.y - b.pose.y) for a, b in itertools.pairwise(odometry)]
    assert max(jumps) < 0.1
    assert not frog.clock().reproducible


def test_no_process_is_left_when_the_host_is_killed(frog: Frog) -> None:
    """The last one, for it ends what the others share."""
    pids = children_of(frog.process.pid)
    assert len(pids) >= 14
    frog.process.kill()
    wait_gone(pids)
