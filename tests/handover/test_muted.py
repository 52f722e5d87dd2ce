"""A run that does not speak for its component numbers nothing that it says, so nobody gets it later."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.bus_schema.messages.protocol.handover import HandoverStep
from tests.handover.parts import Ask, Item, Sink, Source, Totaller
from tests.handover.site import Threads, Wiring


class Farewell(Source):
    """Says something last, as a robot does that stops its wheels."""

    def snapshot(self) -> int:
        return self.number

    def restore(self, number: int) -> None:
        self.number = number

    def on_deactivate(self) -> None:
        self.tell()


@pytest.fixture
def site() -> Iterator[Threads]:
    """Return a source that speaks when it is asked to, and who hears it."""
    made = Threads("memory")
    made.start(Sink, "sink")
    made.start(Totaller, "totaller")
    made.start(Farewell, "source", parameters={"rate": 0.0})
    yield made
    made.close()


def test_what_a_frozen_run_says_as_it_takes_over_again_leaves_no_gap(site: Threads) -> None:
    site.ask("say", Ask(), Item)
    successor = site.spawn(Farewell, "source")
    site.bind("source", successor, Wiring({}, {"items": ("totaller",)}))
    site.step("source", successor, HandoverStep.TAKE_OVER)
    site.incarnations["source"] = successor
    site.take_back("source", 1)
    site.ask("say", Ask(), Item)
    assert site.all_was_heard().heard == 3
    assert site.runtimes["totaller", 1].reporter.status.lost == 0
