"""The inbox of a time source while it waits: control queries are answered and the heartbeat continues."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.lockstep.member import ASK_TIMEOUT
from regraft.patience import Patience
from regraft.runtime.data.inbound import Frontier
from regraft.runtime.runtime import Runtime

MAX_WAIT = 0.1

M = TypeVar("M")


class SourceInbox:
    """Empties the inbox of the source's runtime, on the source's thread."""

    def __init__(self, runtime: Runtime) -> None:
        self._runtime = runtime

    def opening(self, cls: type[M], take: Callable[[M], None]) -> Callable[[Sample], None]:
        """Return what opens members' messages of a class and has them taken; others are reported."""

        def open_and_take(sample: Sample) -> None:
            try:
                take(codec.decode(sample.payload, cls))
            except BadMessage as error:
                self._runtime.reporter.refused(sample.key, "a member", str(error))

        return open_and_take

    def settle(self) -> None:
        """Finish all that the source has begun: heavy work takes wall-clock time, but no simulated time."""
        self._runtime.work()
        while self._runtime.compute.under_way:
            self.pump_and_work()

    def pump_and_work(self) -> None:
        """Take what arrives, and do what each result of heavy work leads to before the next one is taken."""
        self.pump(then=self._runtime.work)

    def pump(self, timeout: float = MAX_WAIT, then: Callable[[], object] = lambda: None) -> None:
        """Take what arrives within ``timeout`` seconds, at least what is there; ``then`` is called after each item."""
        runtime = self._runtime
        runtime.answering.answer_parked()
        item = runtime.inbox.get(min(timeout, runtime.reporter.beat_if_due()))
        while item is not None:
            runtime.take(item)
            then()
            item = runtime.inbox.get(0.0)

    def wait_for_inputs(self, frontier: Frontier, within: Patience) -> bool:
        """Wait until the source's own inputs have come as far as they are to be handled; returns whether they have."""
        inbound, ask_at = self._runtime.inbound, time.monotonic() + ASK_TIMEOUT
        while not inbound.holds(frontier):
            behind = inbound.reaches(frontier)
            hopeless = (behind or time.monotonic() > ask_at) and not inbound.ask_for_missing(frontier)
            if hopeless or within.is_over():
                return behind
            self.pump()
        return True

    def pump_until(self, ready: Callable[[], bool], deadline: float) -> bool:
        """Take what arrives until ``ready`` or the deadline (monotonic seconds); returns whether it became ready."""
        while not ready():
            left = deadline - time.monotonic()
            if left <= 0:
                return False
            self.pump(min(left, MAX_WAIT))
        return True
