"""Clients that come and go by the thousand."""

from __future__ import annotations

import os

import pytest

from regraft.client import Client
from regraft.host.watchdog.memory_use import resident_size
from tests.hostile.bus.raw import stranger
from tests.hostile.components.test_bad_components import heard
from tests.hostile.conftest import SINK, SOURCE, Start
from tests.support.systems import System
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow


def _goes_on(system: System) -> None:
    before = heard(system)
    wait_until(lambda: heard(system) > before + 20, "the sink to hear more")
    system.must_have_kept_all()


def _come_and_go(system: System, count: int) -> None:
    for number in range(count):
        if number % 10:
            with stranger(system.info) as raw:
                raw.put(system.client.keys.topic("numbers"), b"hello")
        else:
            with Client.connect(system.info) as client:
                assert "sink" in client.components()


def test_clients_that_come_and_go_leave_nothing_behind(start: Start) -> None:
    system = start(SOURCE + SINK)
    system.wait_running("sink")
    _come_and_go(system, 30)
    files = len(os.listdir(f"/proc/{system.process.pid}/fd"))
    _come_and_go(system, 30)
    wait_until(lambda: len(os.listdir(f"/proc/{system.process.pid}/fd")) <= files + 5, "the links to be closed")
    _goes_on(system)


@pytest.mark.evidence
def test_a_thousand_clients_that_come_and_go_leave_nothing_behind(start: Start) -> None:
    system = start(SOURCE + SINK)
    system.wait_running("sink")
    _come_and_go(system, 100)
    before = resident_size(system.process.pid)
    _come_and_go(system, 1000)
    _goes_on(system)
    print(f"the host grew from {before:.0f} to {resident_size(system.process.pid):.0f} MiB")
    assert resident_size(system.process.pid) < before + 95
