"""Hand-overs between real processes on the real bus, and every way in which one can go wrong."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft import Component
from regraft.bus_schema.messages.protocol.control import ControlCode, ParameterValues
from regraft.bus_schema.messages.protocol.handover import HandoverStep
from tests.handover.parts import (
    Ask,
    Caller,
    DiesHandingOver,
    DiesLive,
    DiesRestoring,
    HangsHandingOver,
    HangsLive,
    HangsRestoring,
    Item,
    Sink,
    Source,
    Totaller,
)
from tests.handover.site import Processes, Refused, Wiring
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

WIRING = Wiring({"items": ("source",)}, {"totals": ("sink",)})
NOTHING = (0, 0, 0, 0)
LOST_WITHOUT_HOLDING = 500
"""Messages that would be lost, of a thousand a second, if those that came since the pull were not handled."""
SHORT = 0.3
"""Seconds that the answer of somebody who hangs is waited for."""


@pytest.fixture
def site() -> Iterator[Processes]:
    """A source at 1 kHz and a sink, for a totaller between them."""
    made = Processes()
    made.start(Sink, "sink")
    yield made
    made.close()


def begin(site: Processes, cls: type[Component] = Totaller) -> None:
    site.start(cls, "totaller")
    site.start(Source, "source")
    site.hears_on(50)


def ready(site: Processes, cls: type[Component] = Totaller) -> int:
    successor = site.spawn(cls, "totaller")
    site.bind("totaller", successor, WIRING)
    return successor


@pytest.mark.parametrize("swaps", [30, pytest.param(300, marks=[pytest.mark.evidence, pytest.mark.timeout(900)])])
def test_all_goes_on_while_a_component_is_handed_over_again_and_again(site: Processes, swaps: int) -> None:
    begin(site)
    site.start(Caller, "caller")
    goal = site.client.goal("walk", Ask(1_000_000), Item, Item)
    for _ in range(swaps):
        site.swap(Totaller, "totaller", WIRING)
    heard = goal.feedback
    wait_until(lambda: goal.feedback != heard, "the goal goes on")
    site.ask("hurry", Ask(999_999), Item)
    assert goal.result(10.0) == Item(1_000_000)
    site.control("caller", 1, "parameters", ParameterValues({"rate": 0.0}))
    wait_until(lambda: site.asked().answered == site.asked().asked, "all calls are answered")
    asked = site.asked()
    assert (asked.failed, asked.miscounted, asked.strange) == (0, 0, 0)
    assert site.faults() == NOTHING


# --- the successor ends, before it takes over, while it does, and after ---


@pytest.mark.parametrize("how", ["killed", "hung"])
def test_a_successor_lost_before_it_takes_over_is_not_missed(site: Processes, how: str) -> None:
    begin(site)
    successor = ready(site)
    if how == "hung":
        site.hang("totaller", successor)
        with pytest.raises(TimeoutError):
            site.step("totaller", successor, HandoverStep.TAKE_OVER, SHORT)
    site.kill("totaller", successor)
    site.step("totaller", 1, HandoverStep.RESUME, peer=successor)
    assert site.role("totaller", 1) == "live"
    site.hears_on(50)
    assert site.faults() == NOTHING


@pytest.mark.parametrize("cls", [DiesRestoring, HangsRestoring])
def test_the_incumbent_resumes_without_loss_when_its_successor_is_lost_after_the_pull(
    site: Processes, cls: type[Component]
) -> None:
    begin(site)
    successor = ready(site, cls)
    with pytest.raises(TimeoutError):
        site.step("totaller", successor, HandoverStep.TAKE_OVER, SHORT)
    wait_until(lambda: site.role("totaller", 1) == "frozen", "the incumbent has handed over")
    site.kill("totaller", successor)
    site.resume("totaller", 1, successor)
    site.hears_on(50)
    assert site.faults() == NOTHING
    site.swap(Totaller, "totaller", WIRING)
    assert site.faults() == NOTHING


@pytest.mark.parametrize("cls", [DiesLive, HangsLive])
def test_the_incumbent_resumes_without_loss_when_its_successor_is_lost_just_after_it_went_live(
    site: Processes, cls: type[Component]
) -> None:
    begin(site)
    successor = ready(site, cls)
    site.step("totaller", successor, HandoverStep.TAKE_OVER)
    before = site.report().last
    wait_until(lambda: site.report().last == site.report().last > before, "the successor was heard, and is no more")
    site.kill("totaller", successor)
    site.resume("totaller", 1, successor)
    site.hears_on(50)
    assert site.faults() == NOTHING


# --- the incumbent ends while it hands over ---


@pytest.mark.parametrize("cls", [DiesHandingOver, HangsHandingOver])
def test_the_successor_of_an_incumbent_that_is_lost_while_it_hands_over_can_be_promoted(
    site: Processes, cls: type[Component]
) -> None:
    begin(site, cls)
    successor = ready(site)
    with pytest.raises(Refused) as refused:
        site.step("totaller", successor, HandoverStep.TAKE_OVER)
    assert refused.value.error.code is ControlCode.TIMED_OUT
    assert site.role("totaller", successor) == "waiting"
    if not site.gone("totaller", 1):
        site.kill("totaller", 1)
    assert site.step("totaller", successor, HandoverStep.PROMOTE)["role"] == "live"
    site.incarnations["totaller"] = successor
    site.hears_on(50)
    report = site.all_was_heard()
    assert report.wrong == 1  # the total began anew, once
    assert report.lost < LOST_WITHOUT_HOLDING


def test_an_incumbent_killed_when_it_is_frozen_is_not_missed(site: Processes) -> None:
    begin(site)
    successor = ready(site)
    site.step("totaller", successor, HandoverStep.TAKE_OVER)
    site.kill("totaller", 1)
    site.incarnations["totaller"] = successor
    site.hears_on(50)
    assert site.faults() == NOTHING
    site.swap(Totaller, "totaller", WIRING)
    assert site.faults() == NOTHING


def test_a_publisher_restarted_in_the_middle_is_heard_from_its_beginning(site: Processes) -> None:
    begin(site)
    successor = ready(site)
    site.kill("source", 1)
    site.restart(Source, "source")
    site.step("totaller", successor, HandoverStep.TAKE_OVER)
    site.incarnations["totaller"] = successor
    site.hears_on(50)
    report = site.all_was_heard()
    assert (report.lost, report.disordered, report.wrong) == (0, 1, 0)  # it began anew, once


# --- the manager is gone ---


def test_a_successor_that_nobody_tells_to_take_over_disturbs_nobody(site: Processes) -> None:
    begin(site)
    successor = ready(site)
    site.hears_on(100)
    assert (site.role("totaller", 1), site.role("totaller", successor)) == ("live", "waiting")
    assert site.faults() == NOTHING
    site.step("totaller", successor, HandoverStep.RETIRE)
    wait_until(lambda: site.gone("totaller", successor), "it ends when it is told to")


def test_a_take_over_is_finished_although_nobody_waits_for_it(site: Processes) -> None:
    begin(site)
    successor = ready(site)
    with pytest.raises(TimeoutError):
        site.step("totaller", successor, HandoverStep.TAKE_OVER, 0.0001)
    wait_until(lambda: site.role("totaller", successor) == "live", "the successor is live")
    assert site.role("totaller", 1) == "frozen"
    site.hears_on(100)
    assert site.faults() == NOTHING
    site.step("totaller", 1, HandoverStep.RETIRE)
    wait_until(lambda: site.gone("totaller", 1), "the incumbent ends when it is told to")
