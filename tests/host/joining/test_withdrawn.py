"""A start elsewhere that still waits for its turn is withdrawn when the host is back."""

from __future__ import annotations

import pytest

from regraft.bus_schema.messages.management.manager import ConfirmAdaptation
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Outcome, SetParameters
from regraft.bus_schema.model.hosts.host_state import HostState
from tests.host.several import MOVE, TICKER, Site
from tests.support.hosts import state_of, wait_state
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow


def test_components_stay_on_a_host_that_is_back_before_their_start_elsewhere_has_its_turn(site: Site) -> None:
    system = site.up(
        f"{TICKER}  here: {{class: 'tests.host.parts:Ticker', host: local, connect: {{ticks: pulses}}}}\n", MOVE
    )
    link = site.link()
    site.join("edge", link.endpoint)
    first = site.wait_active("ticker")
    site.wait_active("here")
    held = AdaptationRequest((SetParameters("here", {"step": 4}),), confirm=60.0, wait=False)
    line = system.client.call("adaptation_manager/adapt", held, AdaptationReport, PATIENCE)
    wait_until(lambda: site.journal()[0].outcome is Outcome.CONFIRMING, "the change to be watched over")
    link.cut()
    wait_state(system, "edge", HostState.LOST)
    link.heal()
    wait_until(lambda: state_of(system, "edge") is HostState.JOINED, "edge to be back")
    site.wait_active("ticker", first)
    system.client.call("adaptation_manager/confirm", ConfirmAdaptation(line.id), AdaptationReport, PATIENCE)
    assert site.adapt(SetParameters("here", {"step": 2})).outcome is Outcome.APPLIED
    assert site.host_of("ticker") == "edge"
    assert not system.said("host.stranded", "edge")
