"""Processes that the machine keeps from running for a while: messages are delayed, and none is lost or wrong."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from tests.handover.parts import Ask, Item
from tests.host.moves.moving import Moving
from tests.host.several import Site
from tests.support.machine.processes import go_on, stop
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

FREEZES = 4
FROZEN_FOR = 0.2
"""Seconds: shared memory is taken back from a reader after 0.1, and a run is hung after 0.45."""


def freeze(pid: int) -> None:
    """Keep a process from running for a while."""
    stop(pid)
    try:
        threading.Event().wait(FROZEN_FOR)
    finally:
        go_on(pid)


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Moving]:
    """Return a stream and pictures on one host."""
    folder = tmp_path_factory.mktemp("starved")
    with home(folder / "home"):
        site = Site(folder)
        made = Moving(site, pictures=True)
        made.wait_flowing()
        yield made
        site.close()


@pytest.mark.parametrize("name", ["source", "totaller", "painter", "viewer", "the hub"])
def test_a_process_that_is_kept_from_running_delays_messages_and_loses_none(moving: Moving, name: str) -> None:
    pid = moving.system.process.pid if name == "the hub" else moving.site.pid(name)
    before = _viewed(moving)
    for _ in range(FREEZES):
        freeze(pid)
        moving.hears_on()
    moving.check()
    wait_until(lambda: _viewed(moving).number > before.number, "another picture")
    assert _viewed(moving).total == 0, "a picture was lost, doubled or wrong"
    assert all(process.restarts == 0 for process in moving.system.processes().values())


def _viewed(moving: Moving) -> Item:
    """Return how many pictures came, and how many of them were wrong."""
    return moving.system.client.call("viewed", Ask(), Item, PATIENCE)
