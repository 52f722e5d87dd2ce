"""The checkpoint of a run that ended lasts until its successor works."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft import Component
from regraft.bus_schema.messages.protocol.control import SetTransition, Snapshot
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.handover.parts import Ask, Item, Sink, Source, Totaller
from tests.handover.site import Threads, Wiring
from tests.support.waiting import wait_until

WIRING = Wiring({"items": ("source",)}, {"totals": ("sink",)})


@pytest.fixture(params=["memory", "zenoh"])
def site(request: pytest.FixtureRequest) -> Iterator[Threads]:
    """A bus of either kind, with a source, a totaller and a sink."""
    made = Threads(request.param)
    made.start(Sink, "sink")
    made.start(Totaller, "totaller")
    made.start(Source, "source", parameters={"rate": 500.0})
    yield made
    made.close()


def crashed(site: Threads, cls: type[Component], state: State) -> None:
    """Have the totaller restarted with a checkpoint, after it was called five times."""
    site.kill("totaller", 1)
    checkpoint = Snapshot("totaller", 1, 0.0, Totaller.state_version, {"total": 9, "calls": 5, "steps": 0})
    site.assigned["totaller"] = {"checkpoint": checkpoint, "state": state}
    site.restart(cls, "totaller")
    site.assigned["totaller"] = {}


def test_a_run_that_was_never_activated_hands_its_checkpoint_over(site: Threads) -> None:
    crashed(site, Totaller, State.INACTIVE)
    wait_until(lambda: site.view("totaller").state is State.INACTIVE, "it is inactive")
    site.swap(Totaller, "totaller", WIRING)
    site.control("totaller", 3, "transition", SetTransition(Transition.ACTIVATE))
    assert site.ask("count", Ask(), Item).total == 6


class Hesitant(Totaller):
    """Cannot be activated at once."""

    tried = False

    def on_activate(self) -> None:
        if not self.tried:
            self.tried = True
            raise OSError("not yet")


def test_a_checkpoint_outlives_an_activation_that_fails(site: Threads) -> None:
    crashed(site, Hesitant, State.ACTIVE)
    wait_until(lambda: site.component("totaller").tried, "it has been tried")
    for transition in (Transition.CONFIGURE, Transition.ACTIVATE):
        site.control("totaller", 2, "transition", SetTransition(transition))
    assert site.ask("count", Ask(), Item).total == 6
