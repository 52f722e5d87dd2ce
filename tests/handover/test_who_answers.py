"""Of several runs, the one that speaks for the component answers what is asked of any."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from regraft.bus.interface import Answer
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.messages.protocol.control import Resend, Resent
from regraft.bus_schema.messages.protocol.handover import HandoverStep
from regraft.bus_schema.messages.quality import Quality
from tests.handover.parts import Ask, Item, Source
from tests.handover.site import Threads, Wiring
from tests.support.waiting import PATIENCE, wait_until

QUESTIONS = 20
"""On the real bus, either run could be the first to answer."""


@pytest.fixture(params=["memory", "zenoh"])
def site(request: pytest.FixtureRequest) -> Iterator[Threads]:
    """Return a source that speaks when it is asked to, on a bus of either kind."""
    made = Threads(request.param)
    made.start(Source, "source", parameters={"rate": 0.0})
    yield made
    made.close()


def _hand_over(site: Threads) -> int:
    """Have a successor speak next to its frozen incumbent; returns its incarnation."""
    successor = site.spawn(Source, "source")
    site.bind("source", successor, Wiring())
    site.step("source", successor, HandoverStep.TAKE_OVER)
    site.incarnations["source"] = successor
    return successor


def _report(site: Threads, metric: float) -> None:
    """Have the live run report how a requirement is met."""
    runtime, reported = site.runtimes["source", site.incarnations["source"]], threading.Event()

    def report() -> None:
        runtime.component.kit.report_quality(Quality(1.0, "Steady", "Calm", metric=metric, satisfied=metric < 1.0))
        reported.set()

    runtime.post(report)
    assert reported.wait(PATIENCE)
    # A session hears only after a while that another one answers for something new.
    wait_until(lambda: bool(_answers(site)), "the requirement is answered for")


def _asked(site: Threads) -> Quality:
    """Return how the requirement is met, by the first answer."""
    (answer,) = _answers(site)
    return codec.decode(answer.payload, Quality)


def _answers(site: Threads) -> list[Answer]:
    return site.bus.query(site.keys.quality("Steady"), b"", PATIENCE)


def test_a_question_for_samples_to_any_run_is_answered_by_the_one_that_speaks(site: Threads) -> None:
    successor = _hand_over(site)
    site.ask("say", Ask(), Item)
    asked = codec.encode(Resend(site.keys.topic("items"), 0, 1, None))
    for _ in range(QUESTIONS):
        (answer,) = site.bus.query(site.keys.control("source", "*", "resend"), asked, PATIENCE)
        resent = codec.decode(answer.payload, Resent)
        assert [Envelope.from_bytes(sample.attachment).incarnation for sample in resent.samples] == [successor]


def test_how_a_requirement_is_met_is_answered_by_the_one_that_speaks(site: Threads) -> None:
    _report(site, 0.5)
    _hand_over(site)
    _report(site, 2.0)
    for _ in range(QUESTIONS):
        assert _asked(site).metric == 2.0


def test_a_requirement_is_known_of_a_successor_and_its_task_does_not_run_yet(site: Threads) -> None:
    _report(site, 0.5)
    assert _asked(site).active
    _hand_over(site)
    site.step("source", 1, HandoverStep.RETIRE)
    wait_until(lambda: site.gone("source", 1), "the incumbent ends")
    known = _asked(site)
    assert (known.metric, known.active) == (0.5, False)


def test_a_run_that_takes_over_again_knows_what_its_successor_reported(site: Threads) -> None:
    _report(site, 0.5)
    _hand_over(site)
    _report(site, 2.0)
    site.take_back("source", 1)
    known = _asked(site)
    assert (known.metric, known.active) == (2.0, False)
