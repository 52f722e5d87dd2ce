"""A component in step that has everything a swap could lose, and those around it that would notice."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import ClassVar

from regraft import CallFailed, Component, Input, Output, every
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Change, SetParameters, Swap
from tests.handover.parts import Ask, Item, Totaller
from tests.support.waiting import PATIENCE

HERE = "tests.adaptation.swaps.gathering"


class Gatherer(Totaller):
    """Hears items twice: at once, as a totaller does, and late, when it looks what has come."""

    quiet = Input(Item, topic="items", keep=1000)
    sums = Output(Item)

    def on_configure(self) -> None:
        super().on_configure()
        self.configured_at = self.kit.now()
        self.looks = self.gathered = 0

    @every(seconds=0.35)
    def look(self) -> None:
        self.looks += 1
        self.gathered += sum(item.number for item in self.quiet.take())
        self.sums.publish(Item(self.looks, self.gathered))

    def snapshot(self) -> PlainValue:
        return {**super().snapshot(), "looks": self.looks, "gathered": self.gathered}

    def restore(self, state: PlainValue) -> None:
        super().restore(state)
        self.looks, self.gathered = state["looks"], state["gathered"]


class Thinker(Gatherer):
    """Goes on from a gatherer's state, greets, and thinks about something as it begins."""

    greetings = Output(Item, topic="greetings")

    def on_activate(self) -> None:
        self.greetings.publish(Item(round(self.configured_at * 1000), self.kit.tick or 0))
        self.sums.publish(Item(0, self.gathered))
        self.kit.spawn(self.think(), "thinking")

    async def think(self) -> None:
        self.greetings.publish(Item(await self.kit.compute(_think, self.gathered), 0))


def _think(number: int) -> int:
    time.sleep(0.02)
    return number % 97


class Lame(Thinker):
    """Says something, and then cannot be activated."""

    def on_activate(self) -> None:
        self.sums.publish(Item(0, 0))
        raise RuntimeError("cannot get up")


class Stiff(Gatherer):
    """Cannot be configured."""

    def on_configure(self) -> None:
        raise RuntimeError("not like this")


class Amnesiac(Gatherer):
    """Cannot take a state that it should."""

    def restore(self, state: PlainValue) -> None:
        raise ValueError("not this one")


class Witness(Component):
    """Uses the gatherer in every way, and writes down all that it notices, and when."""

    totals = Input(Item)
    sums = Input(Item)
    greetings = Input(Item, required=False)

    def on_activate(self) -> None:
        self.seen: list[tuple[str, float, int, int]] = []
        self.kit.spawn(self.walk(), "walking")

    def _note(self, what: str, item: Item) -> None:
        self.seen.append((what, self.kit.now(), item.number, item.total))

    @totals.handler
    def hear(self, item: Item) -> None:
        self._note("total", item)

    @sums.handler
    def hear_sum(self, item: Item) -> None:
        self._note("sum", item)

    @greetings.handler
    def hear_greeting(self, item: Item) -> None:
        self._note("greeting", item)

    @every(seconds=0.1)
    async def ask(self) -> None:
        self._note("count", await self.kit.call("count", Ask(7), Item, timeout=PATIENCE))

    @every(seconds=0.45)
    async def ponder(self) -> None:
        try:
            self._note("ponder", await self.kit.call("ponder", Ask(8), Item, timeout=PATIENCE))
        except CallFailed as error:
            self._note(str(error), Item(0))

    async def walk(self) -> None:
        """Have it make many steps, again and again."""
        while True:
            await self.kit.sleep(0.1)
            goal = self.kit.goal("walk", Ask(30), Item, feedback=Item)
            self._note("walk", await goal.outcome())


class Swapper(Component):
    """Asks for one adaptation after the other, at certain times, and remembers what became of them."""

    script: ClassVar[tuple[tuple[Change, ...], ...]] = (
        (Swap("gatherer", f"{HERE}:Thinker"),),
        (SetParameters("gatherer", {"offset": 2}), Swap("gatherer", f"{HERE}:Gatherer")),
        (Swap("gatherer", f"{HERE}:Stiff"),),
        (Swap("gatherer", f"{HERE}:Amnesiac"),),
        (Swap("gatherer", f"{HERE}:Lame"),),
        (Swap("gatherer", f"{HERE}:Thinker"), SetParameters("fragile", {"level": 3})),
        (Swap("gatherer", f"{HERE}:Thinker"),),
        (Swap("gatherer", parameters={"offset": 4}),),
    )

    def on_activate(self) -> None:
        self.reports: list[AdaptationReport] = []
        self.kit.spawn(self.adapt(), "adapting")

    async def adapt(self) -> None:
        for changes in self.script:
            await self.kit.sleep(0.53)
            request = AdaptationRequest(changes, actor="swapper")
            report = await self.kit.call("adaptation_manager/adapt", request, AdaptationReport, timeout=PATIENCE)
            self.reports.append(
                replace(report, duration=0.0, phases=(), steps=tuple(replace(s, duration=0.0) for s in report.steps))
            )
