"""A goal that a run has given ends with that run, unless it is to outlive it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft import Component
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.protocol.handover import HandoverStep
from regraft.runtime.requests.request_server import RunningGoal
from tests.handover.parts import Ask, Item, Totaller
from tests.handover.site import Refused, Threads
from tests.support.waiting import wait_until

FAR = 1_000_000


class Sender(Component):
    """Has somebody walk far when it first begins; whoever continues from it has other plans."""

    outlives = False

    def on_configure(self) -> None:
        self.continues = False

    def on_activate(self) -> None:
        if not self.continues:
            self.kit.goal("walk", Ask(FAR), Item, Item, outlives=self.outlives)

    def snapshot(self) -> PlainValue:
        return None

    def restore(self, state: PlainValue) -> None:
        self.continues = True


class Detached(Sender):
    """Has somebody walk for as long as it takes."""

    outlives = True


class Idle(Sender):
    """Has nobody walk."""

    def on_activate(self) -> None:
        pass


class Hopeless(Sender):
    """Cannot begin."""

    def on_activate(self) -> None:
        raise ValueError("no plans at all")


@pytest.fixture(params=["memory", "zenoh"])
def site(request: pytest.FixtureRequest) -> Iterator[Threads]:
    """Return somebody who walks, on a bus of either kind."""
    made = Threads(request.param)
    made.start(Totaller, "totaller")
    yield made
    made.close()


def _goals(site: Threads) -> list[RunningGoal]:
    """Return the goals that are pursued."""
    return [goal for server in site.runtimes["totaller", 1].servers for goal in list(server.goals.values())]


def _start(site: Threads, cls: type[Component] = Sender) -> None:
    site.start(cls, "sender")
    wait_until(lambda: _goals(site), "the walk to begin")


def _hand_over(site: Threads, cls: type[Component] = Sender) -> None:
    """Have a successor speak next to the frozen incumbent, which is kept."""
    successor = site.spawn(cls, "sender")
    site.step("sender", successor, HandoverStep.TAKE_OVER)
    site.incarnations["sender"] = successor


def _walks_on(site: Threads) -> None:
    totaller = site.component("totaller")
    before = totaller.steps
    wait_until(lambda: totaller.steps > before + 10, "the walk to go on")


def test_a_goal_ends_when_a_successor_has_taken_over_from_its_client(site: Threads) -> None:
    _start(site)
    _hand_over(site)
    wait_until(lambda: not _goals(site), "the walk to end")


def test_a_goal_that_outlives_its_client_goes_on_beside_a_successor(site: Threads) -> None:
    _start(site, Detached)
    _hand_over(site, Detached)
    _walks_on(site)
    assert _goals(site)


def test_a_goal_goes_on_where_the_successor_cannot_take_over(site: Threads) -> None:
    _start(site)
    with pytest.raises(Refused, match="no plans at all"):
        _hand_over(site, Hopeless)
    site.resume("sender", 1, 2)
    _walks_on(site)
    assert _goals(site)


def test_the_goal_of_a_successor_ends_when_its_incumbent_takes_over_again(site: Threads) -> None:
    _start(site)
    _hand_over(site)
    successor = site.runtimes["sender", 2]
    wait_until(lambda: not _goals(site), "the first walk to end")
    successor.post(lambda: successor.component.kit.goal("walk", Ask(FAR), Item, Item))
    wait_until(lambda: _goals(site), "the second walk to begin")
    site.take_back("sender", 1)
    wait_until(lambda: not _goals(site), "the second walk to end")


def test_a_goal_ends_where_its_client_has_died_and_the_successor_goes_on_alone(site: Threads) -> None:
    _start(site)
    successor = site.spawn(Idle, "sender")
    site.kill("sender", 1)
    site.step("sender", successor, HandoverStep.PROMOTE)
    wait_until(lambda: not _goals(site), "the walk to end")
