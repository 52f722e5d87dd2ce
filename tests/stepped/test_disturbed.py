"""Simulated time in step when something unusual happens: strangers, idle readers, the death of a slot's holder."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable

import pytest

from regraft import CallFailed, Component, Input, Output, action, every, service
from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.clock import Wiring
from regraft.bus_schema.messages.protocol.control import SetTransition
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.lockstep.membership import MAX_BACKLOG, Membership
from tests.kit.parts import Follower, Number, Walker
from tests.stepped.parts import Reading, Text, TinyWorld
from tests.support.stepped.step_site import StepSite
from tests.support.waiting import PATIENCE, wait_until


class OnDemand(Component):
    """Looks at the position only when it is asked."""

    position = Input(Reading)

    @service("look")
    def look(self, _: Text) -> Reading:
        seen = self.position.latest
        assert seen is not None
        return seen


class Listener(Component):
    """Counts positions, once it is active."""

    position = Input(Reading)

    def __init__(self) -> None:
        self.heard = 0

    @position.handler
    def hear(self, _: Reading) -> None:
        self.heard += 1


class Activator(Component):
    """Activates the listener in a slot, and holds the slot then."""

    def __init__(self) -> None:
        self.answers = 0

    @service("activate")
    async def activate(self, _: Text) -> Text:
        async with self.kit.exclusive():
            key = f"{self.kit.system}/component/listener/1/transition"
            self.answers = len(await self.kit.ask(key, codec.encode(SetTransition(Transition.ACTIVATE)), PATIENCE))
            await self.kit.compute(self.held.wait, PATIENCE)
        return Text()

    held = threading.Event()


class Dawdler(Component):
    """Sleeps while it holds the slot."""

    @service("dawdle")
    async def dawdle(self, _: Text) -> Text:
        async with self.kit.exclusive():
            await self.kit.sleep(1.0)
        return Text()


class Pusher(Component):
    """Pushes the world for a day, and stops it then."""

    push = Output(Reading)

    @action("walk", feedback=Number)
    async def walk(self, goal: Number) -> Number:
        self.push.publish(Reading(self.kit.now(), 2.0))
        try:
            await self.kit.sleep(86_400.0)
        finally:
            self.push.publish(Reading(self.kit.now(), 0.0))
        return goal


def test_what_a_stranger_tells_the_world_reaches_it_in_a_slot(steps: StepSite) -> None:
    steps.start_world(TinyWorld, (), 3600.0)
    steps.wait_for_time(1.0)
    steps.publish("push", Reading(0.0, 2.0), "keyboard")
    wait_until(lambda: steps.component("world").v == 2.0, "the world to be pushed")
    assert steps.told().reproducible


def test_a_component_that_only_reads_when_asked_holds_few_messages(steps: StepSite) -> None:
    steps.start(OnDemand, "reader")
    steps.start_world(TinyWorld, ("reader",), 20.0)
    steps.wait_finished()
    held = [len(stream.waiting) for stream in steps.runtimes["reader"].inbound.streams.values()]
    assert max(held) <= MAX_BACKLOG
    assert steps.client.call("look", Text(), Reading, PATIENCE).stamp > 0.0


def test_what_was_done_in_a_slot_holds_when_its_holder_dies_in_it(steps: StepSite) -> None:
    Activator.held.clear()
    steps.start(Activator, "activator")
    steps.start(Listener, "listener", state=State.INACTIVE)
    steps.start_world(TinyWorld, ("activator", "listener"), 3600.0)
    steps.wait_for_time(1.0)

    activator = steps.component("activator")

    def ask() -> None:
        while activator.answers == 0:
            with contextlib.suppress(CallFailed):
                steps.client.call("activate", Text(), Text, 1.0)

    asked = threading.Thread(target=ask, daemon=True)
    asked.start()
    wait_until(lambda: activator.answers == 1, "the listener to be activated")
    steps.cut_off("activator")
    wait_until(lambda: steps.component("listener").heard > 10, "the listener to hear")
    Activator.held.set()
    steps.threads["activator"].join()
    asked.join(PATIENCE)


def test_a_goal_ends_in_step_when_the_run_of_its_client_does(steps: StepSite) -> None:
    steps.start(Walker, "walker")
    steps.start(Follower, "follower")
    steps.start_world(TinyWorld, ("follower", "walker"), 3600.0)
    wait_until(lambda: "walker" in steps.runtimes and steps.runtimes["walker"].servers[0].goals, "a goal")
    steps.kill("follower")
    wait_until(lambda: steps.component("walker").ended == ["cancelled"], "the walk to end")


def test_a_goal_ends_in_step_however_long_its_action_sleeps(steps: StepSite) -> None:
    steps.start(Pusher, "pusher")
    steps.start(Follower, "follower")
    steps.start_world(TinyWorld, ("follower", "pusher"), 3600.0)
    steps.wait_for_time(0.5)
    wait_until(lambda: steps.component("world").v == 2.0, "the world to be pushed")
    steps.kill("follower")
    wait_until(lambda: steps.component("world").v == 0.0, "the world to be stopped")


def test_a_goal_fails_when_whoever_had_accepted_it_does_not_come_back(steps: StepSite) -> None:
    steps.start(Walker, "walker")
    steps.start(Follower, "follower")
    steps.start_world(TinyWorld, ("follower", "walker"), 3600.0)
    wait_until(lambda: "walker" in steps.runtimes and steps.runtimes["walker"].servers[0].goals, "a goal")
    (pending,) = steps.runtimes["follower"].requests.under_way()
    wait_until(lambda: pending.accepted.done, "the goal's client to know that it is accepted")
    steps.kill("walker")
    wait_until(lambda: pending.outcome.done, "the goal to fail")
    assert isinstance(pending.outcome.error, CallFailed)
    assert "is gone" in pending.outcome.error.problem


def test_a_goal_of_a_client_outside_of_the_clock_ends_with_it(steps: StepSite) -> None:
    steps.start(Walker, "walker")
    steps.start_world(TinyWorld, ("walker",), 3600.0)
    passer = steps.another_client("passer")
    passer.goal("walk", Number(10_000_000), Number, Number)
    passer.close()
    wait_until(lambda: steps.component("walker").ended == ["cancelled"], "the walk to end")


def test_a_source_that_leaves_and_returns_at_once_is_not_forgotten_after_its_return() -> None:
    membership = Membership()
    key = "s/topic/t"
    reader = membership.add("reader", 1, Wiring({key: False}, {}), None)
    membership.add("writer", 1, Wiring({}, {key: 7}), None)
    membership.confirm((key, "writer", "reader"), 7)
    membership.remove("writer")
    assert reader.gone == {"writer"}
    writer = membership.add("writer", 2, Wiring({}, {key: 0}), None)
    membership.confirm((key, "writer", "reader"), 0)
    membership.advance(writer, {key: 3})
    assert reader.gone == set()
    assert reader.begin_step() == {key: {"writer": 3}}


def test_a_run_that_was_released_leaves_no_numbering_to_the_next_one_of_its_name() -> None:
    membership = Membership()
    key = "s/topic/t"
    reader = membership.add("reader", 1, Wiring({key: False}, {}), None)
    membership.add("writer", 1, Wiring({}, {key: 7}), None)
    membership.confirm((key, "writer", "reader"), 5)
    membership.leave("writer")
    writer = membership.add("writer", 2, Wiring({}, {key: 0}), None)
    membership.confirm((key, "writer", "reader"), 0)
    assert "writer" not in reader.begin_step().get(key, {})
    membership.advance(writer, {key: 3})
    assert reader.begin_step() == {key: {"writer": 3}}


def test_a_holder_of_a_slot_that_waits_for_time_is_cancelled_and_time_goes_on(steps: StepSite) -> None:
    steps.start(Dawdler, "dawdler")
    steps.start_world(TinyWorld, ("dawdler",), 3600.0)
    with pytest.raises(CallFailed, match="cancelled"):
        steps.client.call("dawdle", Text(), Text, PATIENCE)
    steps.wait_for_time(steps.told().time / 1e9 + 1.0)
    assert "in a slot, only ask and compute" in steps.runtimes["dawdler"].reporter.status.error


class Reporter(Component):
    """Publishes the time once a second, and a marker right behind it, as for a reader that has just come."""

    times = Output(Reading)

    def on_configure(self) -> None:
        self.mark: Callable[[], object] = lambda: None

    @every(seconds=1.0)
    def report(self) -> None:
        self.times.publish(Reading(self.kit.now(), 0.0))
        self.mark()


class Clerk(Component):
    """Writes down the times."""

    times = Input(Reading, keep=100)

    def __init__(self) -> None:
        self.heard: list[float] = []

    @every(seconds=1.0)
    def write(self) -> None:
        self.heard += [reading.stamp for reading in self.times.take()]


def test_a_message_that_was_lost_before_a_marker_came_is_sent_again(
    steps: StepSite, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps.start(Reporter, "reporter")
    steps.start(Clerk, "clerk")
    wait_until(lambda: {"reporter", "clerk"} <= steps.runtimes.keys(), "both to run")
    steps.component("reporter").mark = steps.runtimes["reporter"].writers.mark_all
    inbound = steps.runtimes["clerk"].inbound
    lost: list[Sample] = []
    arrive = inbound.arrive

    def lose_one(sample: Sample) -> None:
        if sample.key.endswith("/times") and len(sample.payload) and not lost:
            lost.append(sample)
        else:
            arrive(sample)

    monkeypatch.setattr(inbound, "arrive", lose_one)
    steps.start_world(TinyWorld, ("reporter", "clerk"), 4.0)
    assert steps.wait_finished().reproducible
    assert lost
    clerk: Clerk = steps.component("clerk")
    assert clerk.heard == [1.0, 2.0, 3.0]
    assert steps.runtimes["clerk"].reporter.status.lost == 0
