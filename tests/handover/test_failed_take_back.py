"""A run whose successor is given up continues: also one that could not take over again, or was asked for its state."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.handover import Handover, HandoverStep, Place
from regraft.bus_schema.model.lifecycle import State
from tests.handover.parts import UNWANTED, Ask, Choosy, ChoosyHolder, Item, Sink, Source, Tired, Totaller
from tests.handover.site import Refused, Threads, Wiring
from tests.support.waiting import PATIENCE

WIRING = Wiring({"items": ("source",)}, {"totals": ("sink",)})
NOTHING = (0, 0, 0, 0)


@pytest.fixture(params=["memory", "zenoh"])
def site(request: pytest.FixtureRequest) -> Iterator[Threads]:
    """A bus of either kind with a sink."""
    made = Threads(request.param)
    made.start(Sink, "sink")
    yield made
    made.close()


@pytest.mark.parametrize("cls", [Choosy, ChoosyHolder, Tired])
def test_a_run_that_could_not_take_over_again_resumes_as_it_was(site: Threads, cls: type[Totaller]) -> None:
    site.start(cls, "totaller")
    site.start(Source, "source", parameters={"rate": 500.0})
    site.hears_on(10)
    for _ in range(2):
        incumbent = site.incarnations["totaller"]
        successor = site.spawn(Totaller, "totaller")
        site.bind("totaller", successor, WIRING)
        site.step("totaller", successor, HandoverStep.TAKE_OVER)
        site.incarnations["totaller"] = successor
        site.ask("hurry", Ask(UNWANTED), Item)
        site.hears_on(30)
        with pytest.raises(Refused, match="could not take over"):
            site.take_back("totaller", incumbent)
        site.kill("totaller", successor)
        site.resume("totaller", incumbent, successor)
        assert site.view("totaller").state is State.ACTIVE
        site.hears_on(30)
        assert site.faults() == NOTHING
        site.ask("hurry", Ask(0), Item)  # what its successor was asked was repeated


def test_a_run_whose_successor_ended_as_it_asked_for_the_state_is_never_frozen(site: Threads) -> None:
    site.start(Totaller, "totaller")
    site.start(Source, "source", parameters={"rate": 500.0})
    site.hears_on(10)
    successor = site.spawn(Totaller, "totaller")
    site.bind("totaller", successor, WIRING)
    items = site.keys.topic("items")
    handled = site.runtimes["totaller", 1].inbound.streams[items, "source"].handled
    assert handled is not None
    pull = Handover(HandoverStep.PULL, successor, first={items: {"source": Place(1, handled + 100)}})
    site.bus.ask(site.keys.control("totaller", 1, "handover"), codec.encode(pull), PATIENCE, lambda _: None)
    site.kill("totaller", successor)
    site.step("totaller", 1, HandoverStep.RESUME, peer=successor)
    site.hears_on(300)
    assert site.role("totaller", 1) == "live"
    assert site.faults() == NOTHING
