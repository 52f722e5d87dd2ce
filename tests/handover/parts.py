"""Components that are handed over, and those around them that notice."""

from __future__ import annotations

import os
import signal
import threading
import time
from dataclasses import dataclass

from regraft import CallFailed, Component, Input, Output, Parameter, action, every, service
from regraft.bus_schema.annotations import Count, PlainValue
from regraft.bus_schema.encoding.registry import message
from tests.support.waiting import PATIENCE

UNWANTED = 99
"""Steps that some do not continue from."""


@message("handover_tests/Item")
@dataclass(frozen=True, slots=True)
class Item:
    """A numbered item, with the total up to it."""

    number: Count
    total: Count = 0


@message("handover_tests/Ask")
@dataclass(frozen=True, slots=True)
class Ask:
    """Ask for a number."""

    number: Count = 0


@message("handover_tests/Report")
@dataclass(frozen=True, slots=True)
class Report:
    """What was noticed, in counts; ``gap`` is the longest time without anything, in seconds."""

    last: Count
    heard: Count
    lost: Count
    doubled: Count
    disordered: Count
    wrong: Count
    gap: float


class Source(Component):
    """Numbers items."""

    items = Output(Item)
    rate = Parameter(1000.0, minimum=0.0, maximum=5000.0)

    def on_configure(self) -> None:
        self.number = 0

    @every(hz=rate)
    def tell(self) -> None:
        self.number += 1
        self.items.publish(Item(self.number))

    @service("say")
    def say(self, ask: Ask) -> Item:
        self.tell()
        return Item(self.number)


class Totaller(Component):
    """Adds up the numbers of all items: what it says depends on every one."""

    items = Input(Item)
    config = Input(Item, required=False, topic="config")
    totals = Output(Item)
    offset = Parameter(0, minimum=0, maximum=1000)

    state_version = 1

    def on_configure(self) -> None:
        self.napping = threading.Event()
        self.total = 0
        self.calls = 0
        self.steps = 0

    @items.handler
    def add(self, item: Item) -> None:
        self.total += item.number
        self.totals.publish(Item(item.number, self.total))

    @service("count")
    def count(self, ask: Ask) -> Item:
        """Count how often it was called: a call that is done twice is seen."""
        self.calls += 1
        return Item(ask.number, self.calls)

    @service("ponder")
    async def ponder(self, ask: Ask) -> Item:
        """Count, but take a moment in the middle of it."""
        self.calls += 1
        mine = self.calls
        await self.kit.sleep(0.005)
        return Item(ask.number, mine)

    @service("configured")
    def configured(self, ask: Ask) -> Item:
        latest = self.config.latest
        return Item(latest.number if latest else 0, self.offset)

    @action("walk", feedback=Item)
    async def walk(self, goal: Ask) -> Item:
        """Make steps up to a number, going on from where the run before had come to."""
        while self.steps < goal.number:
            self.steps += 1
            self.kit.feedback(Item(self.steps))
            await self.kit.sleep(0.01)
        reached, self.steps = self.steps, 0
        return Item(reached)

    @service("nap")
    def nap(self, ask: Ask) -> Item:
        """Keep everybody waiting for so many milliseconds."""
        self.napping.set()
        time.sleep(ask.number / 1000)
        return Item(ask.number)

    @service("hurry")
    def hurry(self, ask: Ask) -> Item:
        """Have made so many steps."""
        self.steps = ask.number
        return Item(ask.number)

    def snapshot(self) -> PlainValue:
        return {"total": self.total, "calls": self.calls, "steps": self.steps}

    def restore(self, state: PlainValue) -> None:
        self.total, self.calls, self.steps = state["total"], state["calls"], state["steps"]


class Doubler(Totaller):
    """Another class that goes on from a totaller's state."""

    @service("double")
    def double(self, ask: Ask) -> Item:
        return Item(2 * ask.number)


class Newer(Totaller):
    """Its state has another layout."""

    state_version = 2


class Stateless(Component):
    """Has no state to go on from."""

    items = Input(Item)
    totals = Output(Item)

    @items.handler
    def pass_on(self, item: Item) -> None:
        self.totals.publish(Item(item.number, 1))


class Unable(Totaller):
    """Cannot take a state that it should."""

    def restore(self, state: PlainValue) -> None:
        raise ValueError("not this one")


class Choosy(Totaller):
    """Does not take every state, and notices it in the middle."""

    def restore(self, state: PlainValue) -> None:
        self.total = -1
        if state["steps"] == UNWANTED:
            raise ValueError("not this one")
        super().restore(state)


class ChoosyHolder(Choosy):
    """Releases what it holds before another run continues."""

    exclusive = True


class Tired(Totaller):
    """Takes every state, and does not begin with each."""

    def on_activate(self) -> None:
        if self.steps == UNWANTED:
            raise ValueError("too many steps")


class Sink(Component):
    """Checks that totals are complete and in order."""

    totals = Input(Item)

    def on_configure(self) -> None:
        self.last = self.total = self.heard = self.lost = self.doubled = self.disordered = self.wrong = 0
        self.gap = self.before = 0.0

    @totals.handler
    def check(self, item: Item) -> None:
        now = self.kit.now()
        if self.before:
            self.gap = max(self.gap, now - self.before)
        self.before = now
        if self.heard:
            self.lost += max(0, item.number - self.last - 1)
            self.doubled += item.number == self.last
            self.disordered += item.number < self.last
        else:
            self.total = item.total - item.number
        self.total += item.number
        self.wrong += item.total != self.total
        self.total = item.total
        self.heard += 1
        self.last = item.number

    @service("report")
    def report(self, ask: Ask) -> Report:
        """Report; asked with a number, forget the longest gap."""
        told = Report(self.last, self.heard, self.lost, self.doubled, self.disordered, self.wrong, self.gap)
        if ask.number:
            self.gap = 0.0
        return told


@message("handover_tests/Asked")
@dataclass(frozen=True, slots=True)
class Asked:
    """How calls went: how many were answered, failed, counted otherwise than one by one, or got another's answer."""

    asked: Count
    answered: Count
    failed: Count
    miscounted: int
    strange: Count
    slowest: float


class Caller(Component):
    """Calls a service all the time, and checks that it was done once for each call."""

    rate = Parameter(200.0, minimum=0.0, maximum=1000.0)
    service_name = Parameter("count")

    def on_configure(self) -> None:
        self.asked = 0
        self.forget()

    def forget(self) -> None:
        self.answered = self.failed = self.strange = 0
        self.slowest = 0.0
        self.counts: set[int] = set()

    @every(hz=rate)
    async def ask(self) -> None:
        self.asked += 1
        begun = self.kit.now()
        number = int(begun * 1e6)  # no other run asks with the same
        try:
            answer = await self.kit.call(self.service_name, Ask(number), Item, timeout=PATIENCE)
        except CallFailed:
            self.failed += 1
            return
        self.strange += answer.number != number
        self.slowest = max(self.slowest, self.kit.now() - begun)
        self.answered += 1
        self.counts.add(answer.total)

    @service("asked")
    def tell(self, ask: Ask) -> Asked:
        """Tell; counts that were not one after the other mean calls done twice or lost. Asked with a number, forget."""
        span = max(self.counts) - min(self.counts) + 1 if self.counts else 0
        told = Asked(self.asked, self.answered, self.failed, span - self.answered, self.strange, self.slowest)
        if ask.number:
            self.forget()
        return told


class DiesRestoring(Totaller):
    """Is killed after the pull, before it is live."""

    def restore(self, state: PlainValue) -> None:
        os.kill(os.getpid(), signal.SIGKILL)


class HangsRestoring(Totaller):
    """Hangs after the pull, before it is live."""

    def restore(self, state: PlainValue) -> None:
        os.kill(os.getpid(), signal.SIGSTOP)


class DiesLive(Totaller):
    """Is killed when it has handled some items."""

    def on_activate(self) -> None:
        self.left = 100

    @Totaller.items.handler
    def add(self, item: Item) -> None:
        self.left -= 1
        if not self.left:
            os.kill(os.getpid(), signal.SIGKILL)
        super().add(item)


class HangsLive(DiesLive):
    """Hangs when it has handled some items."""

    @Totaller.items.handler
    def add(self, item: Item) -> None:
        self.left -= 1
        if not self.left:
            os.kill(os.getpid(), signal.SIGSTOP)
        Totaller.add(self, item)


class DiesHandingOver(Totaller):
    """Is killed when it is asked for its state."""

    def snapshot(self) -> PlainValue:
        os.kill(os.getpid(), signal.SIGKILL)


class HangsHandingOver(Totaller):
    """Hangs when it is asked for its state."""

    def snapshot(self) -> PlainValue:
        os.kill(os.getpid(), signal.SIGSTOP)
