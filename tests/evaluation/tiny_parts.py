"""A world that counts, and a recorder of it: a run of it takes a second or two."""

from __future__ import annotations

import os

from regraft import Component, Input, Output, Parameter, every
from regraft.bus_schema.messages.geometry import Twist, Vector3
from regraft.bus_schema.model.adaptation import ADAPT, AdaptationReport, AdaptationRequest, SetParameters
from regraft.evaluation.rows import Cell, RowRecorder
from regraft.lockstep.source import TimeSource

WORK = 150_000
"""What is added up in a tick: a run must last long enough to be seen."""


class Counter(TimeSource):
    """Counts up from the run's seed, by ``stride``."""

    count = Output(Twist)
    stride = Parameter(1.0, "what is added in a tick")
    ends_at = Parameter(0, "the tick in which its process ends, 0 for none")

    def advance(self, tick: int, seconds: float) -> None:
        """Say the next number."""
        if tick == self.ends_at > 0:
            os._exit(3)
        worked = sum(range(WORK)) * 0
        self.count.publish(Twist(Vector3(worked + self.kit.seed + self.stride * tick / 3.0)))


class Listener(Component):
    """Hears the numbers."""

    count = Input(Twist)


class Adapter(Component):
    """Has the counter go faster at 2 s, to be confirmed long after that."""

    count = Input(Twist, latest_only=True)

    def __init__(self) -> None:
        self.has_asked = False

    @every(seconds=0.5)
    async def adapt(self) -> None:
        """Ask for it once."""
        if self.has_asked or self.kit.now() < 2.0:
            return
        self.has_asked = True
        faster = SetParameters("counter", {"stride": 5.0})
        request = AdaptationRequest((faster,), "a test", self.kit.name, confirm=30.0, wait=False)
        await self.kit.call(ADAPT, request, AdaptationReport, timeout=20.0)


class Painter(Component):
    """Draws nothing, and tells by what."""

    renderer = Parameter("", "what it tells")

    def on_activate(self) -> None:
        """Tell it."""
        self.kit.set_status_text("paints", renderer=self.renderer)


class CountRecorder(RowRecorder):
    """Writes down the number, and how many have come in the second."""

    count = Input(Twist, keep=256)

    def row(self, now: float) -> dict[str, Cell]:
        """Return what has come."""
        numbers = [twist.linear.x for twist in self.count.take()]
        return {"number": numbers[-1] if numbers else None, "heard": len(numbers), "even": len(numbers) % 2 == 0}


class EndingRecorder(CountRecorder):
    """Writes its last row after three seconds, however long the run is."""

    may_end = True

    def row(self, now: float) -> dict[str, Cell]:
        """Return what has come."""
        self.is_over = now >= 3.0
        return super().row(now)
