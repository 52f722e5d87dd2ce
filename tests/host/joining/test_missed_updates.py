"""A host that may have missed an update has to join again, and then gets what it missed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from regraft.bus_schema.messages.protocol.host import UpdateSpecs
from regraft.bus_schema.messages.protocol.joining import JoinHost, Lease, RenewLease
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.host.joining.joined_hosts import JoinedHosts

ARCHITECTURE = Architecture("tests", 1, False, {}, {}, ("local", "edge"))
HELD, AGAIN = Lease(held=True), Lease(held=False)
TICKER = ComponentSpec("ticker", cls="tests.host.parts:Ticker", host="edge")
UPDATE = UpdateSpecs(2, (TICKER,), ("old",))
MISSED = replace(UPDATE, not_told=("edge",))
CHANGED = ("old", "ticker")


@pytest.fixture
def others() -> JoinedHosts:
    """Return the first host's view of others, of which edge has joined and has given a sign of life."""
    found = JoinedHosts(lambda: ARCHITECTURE, lambda kind, host, text: None, lambda host: None)
    join(found)
    assert renew(found) == HELD
    return found


def join(others: JoinedHosts) -> tuple[str, ...]:
    return others.join(JoinHost("edge", "one"))


def renew(others: JoinedHosts) -> Lease:
    return others.renew(RenewLease("edge", "one"), ending=False)


def test_a_host_that_was_silent_and_missed_nothing_keeps_its_lease(others: JoinedHosts) -> None:
    others.note(UPDATE)
    assert renew(others) == HELD
    others.vanished("edge")
    others.note(replace(UPDATE, not_told=("arm",)))
    assert renew(others) == HELD


@pytest.mark.parametrize("silent", [True, False])
def test_a_host_that_missed_an_update_joins_again(others: JoinedHosts, silent: bool) -> None:
    if silent:
        others.vanished("edge")
    others.note(MISSED)
    assert renew(others) == AGAIN
    assert join(others) == CHANGED
    assert renew(others) == HELD
    assert join(others) == ()


def test_a_host_that_did_not_hear_the_answer_to_its_joining_still_gets_what_it_missed(others: JoinedHosts) -> None:
    others.note(MISSED)
    assert join(others) == CHANGED
    assert join(others) == CHANGED
    others.vanished("edge")
    assert renew(others) == AGAIN
    assert join(others) == CHANGED


def test_another_process_of_a_host_has_missed_nothing(others: JoinedHosts) -> None:
    others.renew(RenewLease("edge", "one", leaving=True), ending=False)
    others.note(MISSED)
    assert others.join(JoinHost("edge", "two")) == ()
