"""Samples as they come, for commands that show them."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Iterator
from typing import Annotated, Generic, TypeVar

import typer

from regraft.cli.terminal.numbers import seconds, whole
from regraft.cli.terminal.output import complain
from regraft.client import Subscription, TopicSample

MAX_WAITING = 1000
"""Messages that wait to be shown. Further ones are dropped and counted."""

CountOption = Annotated[
    int | None, typer.Option("--count", metavar="N", parser=whole(1), help="End after this number of messages.")
]
ForOption = Annotated[
    float | None, typer.Option("--for", metavar="SECONDS", parser=seconds(0.0), help="End after this time.")
]
OnceOption = Annotated[bool, typer.Option("--once", help="End after the first message.")]
Subscribe = Callable[[Callable[[TopicSample], object]], Subscription]
T = TypeVar("T")


class Backlog(Generic[T]):
    """Messages between the client's thread, which takes them, and the one that shows them; ``missed`` are dropped."""

    def __init__(self) -> None:
        """Begin with none."""
        self.missed = 0
        self._queue: queue.Queue[T] = queue.Queue(MAX_WAITING)

    def take(self, message: T) -> None:
        """Have a message wait, or drop it."""
        try:
            self._queue.put_nowait(message)
        except queue.Full:
            self.missed += 1

    def get(self, seconds: float) -> T:
        """Return the next one; raises ``queue.Empty`` if none comes for ``seconds``."""
        return self._queue.get(timeout=seconds)


def samples(subscribe: Subscribe, count: int | None, duration: float | None) -> Iterator[TopicSample]:
    """Yield what comes until ``count`` messages or ``duration`` seconds have passed."""
    waiting: Backlog[TopicSample] = Backlog()
    end = None if duration is None else time.monotonic() + duration
    with subscribe(waiting.take) as subscription:
        seen = 0
        while count is None or seen < count:
            left = 1.0 if end is None else end - time.monotonic()
            if left <= 0:
                break
            try:
                sample = waiting.get(min(left, 1.0))
            except queue.Empty:
                continue
            seen += 1
            yield sample
        if subscription.refused:
            complain(f"{subscription.refused} messages did not fit, the last one: {subscription.last_problem}")
        tell_missed(subscription.dropped + waiting.missed)


def tell_missed(count: int) -> None:
    """Print how many messages were dropped, if any were."""
    if count:
        complain(f"{count} messages came too fast and were not shown")
