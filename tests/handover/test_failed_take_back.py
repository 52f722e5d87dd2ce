"""A frozen run that was asked to take over again and could not: it resumes from what it had itself."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.bus_schema.messages.protocol.handover import HandoverStep
from regraft.bus_schema.model.lifecycle import State
from tests.handover.parts import UNWANTED, Ask, Choosy, ChoosyHolder, Item, Sink, Source, Tired, Totaller
from tests.handover.site import Refused, Threads, Wiring

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
