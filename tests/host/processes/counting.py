"""Components that count: for several clients at once, from where the run before has come to, or what has failed."""

from __future__ import annotations

from dataclasses import dataclass

from regraft import CallFailed, Component, Future, action, every
from regraft.bus_schema.annotations import Count, PlainValue
from regraft.bus_schema.encoding.registry import message

HERE = "tests.host.processes.counting"


@message("counting/Number")
@dataclass(frozen=True, slots=True)
class Number:
    """A number."""

    n: Count


class Counter(Component):
    """Counts to each goal by steps of one."""

    state_version = 1

    def __init__(self) -> None:
        self.counts: dict[str, int] = {}

    @action("count", feedback=Number, goals=3)
    async def count(self, goal: Number) -> Number:
        """Count to a number."""
        me = self.kit.goal_id
        self.counts.setdefault(me, 0)
        while self.counts[me] < goal.n:
            self.counts[me] += 1
            self.kit.feedback(Number(self.counts[me]))
            await self.kit.sleep(0.02)
        return Number(self.counts.pop(me))

    def snapshot(self) -> PlainValue:
        return {"counts": dict(self.counts)}

    def restore(self, state: PlainValue) -> None:
        self.counts = {name: int(n) for name, n in state["counts"].items()}


class OtherCounter(Counter):
    """Counts in its place."""


class LameCounter(Counter):
    """Cannot begin."""

    def on_activate(self) -> None:
        raise RuntimeError("cannot get up")


class LoneCounter(Counter):
    """Counts for one client alone."""

    @action("count", feedback=Number)
    async def count(self, goal: Number) -> Number:
        """Count to a number."""
        return await super().count(goal)


class Hopeful(Component):
    """Asks many services that nobody offers, at once, and counts how many have failed."""

    def __init__(self) -> None:
        self.count = 0
        self.asked = False

    @every(seconds=0.1)
    def ask(self) -> None:
        if self.asked:
            return
        self.asked = True
        for asked in [self.kit.call(f"nothing_{number}", Number(0), Number) for number in range(10)]:
            self.kit.spawn(self._wait(asked))

    async def _wait(self, asked: Future[Number]) -> None:
        try:
            await asked
        except CallFailed:
            self.count += 1

    def snapshot(self) -> dict[str, int]:
        return {"count": self.count}

    def restore(self, state: dict[str, int]) -> None:
        """Begin again."""
