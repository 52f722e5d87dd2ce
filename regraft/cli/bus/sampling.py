"""Samples as they come, for commands that show them."""

from __future__ import annotations

import math
import queue
import time
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Annotated, Generic, TypeVar

import typer

from regraft.cli.terminal.numbers import seconds, whole
from regraft.cli.terminal.output import complain
from regraft.client import Subscription, TopicSample

MAX_WAITING = 1000
"""Messages that wait to be shown. Further ones are dropped and counted."""
LOOK_INTERVAL = 1.0
"""Seconds of silence after which a command looks whether more may come."""

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

    def coming(self, duration: float | None, check: Callable[[], object]) -> Iterator[T]:
        """Yield what comes until ``duration`` seconds have passed; ``check`` is called whenever nothing comes."""
        end = math.inf if duration is None else time.monotonic() + duration
        while (left := end - time.monotonic()) > 0:
            try:
                message = self.get(min(left, LOOK_INTERVAL))
            except queue.Empty:
                check()
                continue
            yield message


def samples(
    subscribe: Subscribe, count: int | None, duration: float | None, check: Callable[[], object]
) -> Iterator[TopicSample]:
    """Yield what comes until ``count`` messages or ``duration`` seconds have passed, or ``check`` raises in silence.

    A topic on which nothing fits is no silent one: the first message that does not fit is reported while it waits, and
    all are counted at the end.
    """
    waiting: Backlog[TopicSample] = Backlog()
    with subscribe(waiting.take) as subscription:
        reported = False

        def look() -> None:
            nonlocal reported
            if subscription.refused and not reported:
                reported = True
                complain(f"a message did not fit: {subscription.last_problem}")
            check()

        try:
            yield from islice(waiting.coming(duration, look), count)
        finally:
            if subscription.refused:
                complain(f"{subscription.refused} messages did not fit, the last one: {subscription.last_problem}")
            tell_missed(subscription.dropped + waiting.missed)


def tell_missed(count: int) -> None:
    """Print how many messages were dropped, if any were."""
    if count:
        complain(f"{count} messages came too fast and were not shown")
