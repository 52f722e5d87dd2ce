"""Processes that the machine keeps from running for a while: messages are delayed, and none is lost or wrong."""

from __future__ import annotations

import os
import signal
import threading

import pytest

from tests.handover.parts import Ask, Item
from tests.host.moving import Moving
from tests.host.several import Site
from tests.support.waiting import PATIENCE

FREEZES = 6
FROZEN_FOR = 0.2
"""Seconds: shared memory is taken back from a reader after 0.1, and a run is hung after 0.45."""


def freeze(pid: int) -> None:
    """Keep a process from running for a while."""
    os.kill(pid, signal.SIGSTOP)
    try:
        threading.Event().wait(FROZEN_FOR)
    finally:
        os.kill(pid, signal.SIGCONT)


@pytest.mark.parametrize("name", ["source", "totaller", "painter", "viewer", "the hub"])
def test_a_process_that_is_kept_from_running_delays_messages_and_loses_none(site: Site, name: str) -> None:
    moving = Moving(site, pictures=True)
    moving.wait_flowing()
    pid = moving.system.process.pid if name == "the hub" else site.pid(name)
    for _ in range(FREEZES):
        freeze(pid)
        moving.hears_on()
    moving.check()
    viewed = moving.system.client.call("viewed", Ask(), Item, PATIENCE)
    assert viewed.number > 0
    assert viewed.total == 0, "a picture was lost, doubled or wrong"
    assert all(process.restarts == 0 for process in moving.system.processes().values())
