"""A move that is undone continues the run of before, or what that had come to."""

from __future__ import annotations

import pytest

from regraft.bus_schema.messages.management.manager import CancelAdaptation
from regraft.bus_schema.model.adaptation import ADAPT, CANCEL, AdaptationReport, AdaptationRequest, Move, Outcome
from regraft.bus_schema.model.hosts.host_state import HostState
from tests.host.several import MOVE, Site
from tests.support.hosts import wait_state
from tests.support.machine.processes import kill, wait_gone
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow


def test_a_run_that_dies_while_it_is_frozen_continues_from_its_checkpoint(site: Site) -> None:
    client = site.up("  ticker: {class: 'tests.host.parts:Ticker'}\n").client
    site.join()
    first, pid = site.wait_active("ticker"), site.pid("ticker")
    wait_until(lambda: site.snapshot("ticker")["count"] > 50, "some ticks")
    before = site.snapshot("ticker")["count"]
    moved = AdaptationRequest((Move("ticker", "edge"),), confirm=60.0, wait=False)
    pending = client.call(ADAPT, moved, AdaptationReport, PATIENCE)
    wait_until(lambda: site.wait_active("ticker", first) and site.host_of("ticker") == "edge", "it to be moved")
    there = site.wait_active("ticker", first)
    kill(pid)
    wait_gone([pid])
    ended = client.call(CANCEL, CancelAdaptation(pending.id), AdaptationReport, PATIENCE)
    assert ended.outcome is Outcome.CANCELLED, ended
    site.wait_active("ticker", there)
    assert site.host_of("ticker") == "local"
    assert site.snapshot("ticker")["count"] >= before - 10


def test_a_component_that_an_undo_puts_back_on_a_lost_host_starts_elsewhere(site: Site) -> None:
    client = site.up(hosts=MOVE).client
    guest = site.join()
    first = site.wait_active("ticker")
    moved = AdaptationRequest((Move("ticker", "local"),), confirm=60.0, wait=False)
    pending = client.call(ADAPT, moved, AdaptationReport, PATIENCE)
    wait_until(lambda: site.journal()[0].outcome is Outcome.CONFIRMING, "the move to be watched over")
    there = site.wait_active("ticker", first)
    guest.process.kill()
    wait_state(site.system, "edge", HostState.LOST)
    ended = client.call(CANCEL, CancelAdaptation(pending.id), AdaptationReport, PATIENCE)
    assert ended.outcome is Outcome.CANCELLED, ended
    site.wait_active("ticker", there)
    assert site.host_of("ticker") == "local"
    assert not site.system.said("host.stranded", "edge")
