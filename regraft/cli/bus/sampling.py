"""Samples as they come, for commands that show them."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Iterator
from typing import Annotated

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


def samples(subscribe: Subscribe, count: int | None, duration: float | None) -> Iterator[TopicSample]:
    """Yield what comes until ``count`` messages or ``duration`` seconds have passed."""
    waiting: queue.Queue[TopicSample] = queue.Queue(MAX_WAITING)
    missed = 0

    def take(sample: TopicSample) -> None:
        nonlocal missed
        try:
            waiting.put_nowait(sample)
        except queue.Full:
            missed += 1

    end = None if duration is None else time.monotonic() + duration
    with subscribe(take) as subscription:
        seen = 0
        while count is None or seen < count:
            left = 1.0 if end is None else end - time.monotonic()
            if left <= 0:
                break
            try:
                sample = waiting.get(timeout=min(left, 1.0))
            except queue.Empty:
                continue
            seen += 1
            yield sample
        _tell_problems(subscription, missed)


def _tell_problems(subscription: Subscription, missed: int) -> None:
    if subscription.refused:
        complain(f"{subscription.refused} messages did not fit, the last one: {subscription.last_problem}")
    if subscription.dropped or missed:
        complain(f"{subscription.dropped + missed} messages came too fast and were not shown")
