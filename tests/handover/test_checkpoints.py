"""A component publishes a checkpoint when it wants to, and is restarted with the last one until it has been active."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from regraft import Component, Input
from regraft.bus.interface import Sample
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.geometry import Twist, Vector3
from regraft.bus_schema.messages.protocol.control import SetTransition, Snapshot, StateRequest, StateStep
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.testing import Rig
from tests.handover.parts import Ask, Item, Newer, Totaller
from tests.handover.site import Refused, Threads, Wiring

CALLS = 7


class Notebook(Component):
    """Keeps what it has heard, at once."""

    heard = Input(Twist, topic="numbers", required=False)

    def __init__(self) -> None:
        self.notes: list[float] = []

    @heard.handler
    def note(self, message: Twist) -> None:
        self.notes.append(message.linear.x)
        self.kit.checkpoint()

    def snapshot(self) -> dict[str, Any]:
        return {"notes": object() if 13.0 in self.notes else list(self.notes)}


def test_a_checkpoint_is_published_when_a_component_asks_for_it() -> None:
    with Rig() as rig:
        kept = _kept(rig)
        rig.publish("numbers", Twist(Vector3(1.0)))
        rig.publish("numbers", Twist(Vector3(2.0)))
        rig.advance(60.0)
        assert [each.state for each in kept] == [{"notes": [1.0]}, {"notes": [1.0, 2.0]}]


def test_a_state_that_cannot_be_kept_is_a_fault_and_the_component_continues() -> None:
    with Rig() as rig:
        kept = _kept(rig)
        rig.publish("numbers", Twist(Vector3(13.0)))
        rig.advance(1.0)
        assert not kept
        (fault,) = rig.take_faults()
        assert "snapshot: state: is object, must be plain data" in fault
        assert rig.status("notebook").state.value == "active"


def _kept(rig: Rig) -> list[Snapshot]:
    """Add the component, and return its checkpoints as they come."""
    kept: list[Snapshot] = []

    def take(sample: Sample) -> None:
        kept.append(codec.decode(sample.payload, Snapshot))

    rig.bus.subscribe(rig.keys.checkpoint("notebook"), take)
    rig.add(Notebook, name="notebook")
    return kept


class Hesitant(Totaller):
    """Does not begin at the first time."""

    def __init__(self) -> None:
        self.tries = 0

    def on_activate(self) -> None:
        self.tries += 1
        if self.tries == 1:
            self.kit.fail("the lidar is not there yet")


class Converting(Newer):
    """Takes a totaller's states as its own."""

    converts_versions = (1,)

    @classmethod
    def convert_state(cls, state: PlainValue, version: int) -> PlainValue:
        return {**state, "calls": state["calls"] * 10}


@pytest.fixture(params=["memory", "zenoh"])
def site(request: pytest.FixtureRequest) -> Iterator[Threads]:
    """A bus of either kind, with nothing on it yet."""
    made = Threads(request.param)
    yield made
    made.close()


def _restart_inactive(site: Threads, cls: type[Component]) -> None:
    """Start a run as its host does after a crash, with the last checkpoint of the one before."""
    checkpoint = Snapshot("totaller", 1, 0.0, 1, {"total": 0, "calls": CALLS, "steps": 0})
    site.start(cls, "totaller", checkpoint=checkpoint, state=State.INACTIVE)


def _go(site: Threads, transition: Transition) -> None:
    site.control("totaller", site.incarnations["totaller"], "transition", SetTransition(transition))


def _next_call(site: Threads) -> int:
    return site.ask("count", Ask(), Item).total


def test_a_component_restarted_inactive_hands_its_checkpoint_over(site: Threads) -> None:
    _restart_inactive(site, Totaller)
    site.assigned["totaller"] = {}
    site.swap(Totaller, "totaller", Wiring())
    _go(site, Transition.ACTIVATE)
    assert _next_call(site) == CALLS + 1


def test_a_checkpoint_of_a_former_version_is_handed_over_converted_once(site: Threads) -> None:
    _restart_inactive(site, Converting)
    site.assigned["totaller"] = {}
    site.swap(Converting, "totaller", Wiring())
    _go(site, Transition.ACTIVATE)
    assert _next_call(site) == 10 * CALLS + 1


def test_an_activation_that_fails_does_not_use_the_checkpoint_up(site: Threads) -> None:
    _restart_inactive(site, Hesitant)
    with pytest.raises(Refused, match="not there yet"):
        _go(site, Transition.ACTIVATE)
    _go(site, Transition.CONFIGURE)
    _go(site, Transition.ACTIVATE)
    assert _next_call(site) == CALLS + 1


def test_a_state_given_to_a_component_replaces_the_checkpoint_it_was_restarted_with(site: Threads) -> None:
    _restart_inactive(site, Totaller)
    given = StateRequest(StateStep.RESTORE, {"total": 0, "calls": 40, "steps": 0}, 1)
    site.control("totaller", 1, "state", given)
    _go(site, Transition.ACTIVATE)
    assert _next_call(site) == 41


def test_what_a_component_has_done_since_it_continued_is_what_it_hands_over(site: Threads) -> None:
    _restart_inactive(site, Totaller)
    _go(site, Transition.ACTIVATE)
    assert _next_call(site) == CALLS + 1
    _go(site, Transition.DEACTIVATE)
    site.swap(Totaller, "totaller", Wiring())
    _go(site, Transition.ACTIVATE)
    assert _next_call(site) == CALLS + 2
