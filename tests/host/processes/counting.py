"""Components that count for several clients at once, and continue where the run before them has come to."""

from __future__ import annotations

from dataclasses import dataclass

from regraft import Component, action
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
