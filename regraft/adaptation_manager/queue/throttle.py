"""Keeps one source of adaptations from taking the manager away from all others.

A source is who asks by the envelope of its messages: a component, a tool's client, or the REST gateway for all who
come through it. A request's own ``actor`` plays no part.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from regraft import RefusalCode, RequestRefused

MAX_SOURCES = 256
TURN = 0.1
"""Seconds, for each request that waits, after which one more may be welcome."""


@dataclass(slots=True)
class Bucket:
    """How many requests a source may make at once, as of ``stamp`` (seconds)."""

    tokens: float
    stamp: float


class Throttle:
    """A token bucket for every source, and a bound on how many of its requests may wait."""

    def __init__(self) -> None:
        self._buckets: dict[str, Bucket] = {}

    def admit(
        self, source: str, waiting: Iterable[str], now: float, *, rate: float, burst: int, most_waiting: int
    ) -> None:
        """Let one request of ``source`` pass, where requests of the sources ``waiting`` wait already.

        ``rate`` is in requests per second. Raises RequestRefused, which states when to retry.
        """
        held = Counter(waiting)[source]
        if held >= most_waiting:
            raise RequestRefused(
                f"{source} has {held} adaptations waiting, and {most_waiting} is the limit for one source "
                "(source_limit of the adaptation manager)",
                RefusalCode.THROTTLED,
                retry_after=TURN * held,
            )
        bucket = self._buckets.pop(source, None) or Bucket(float(burst), now)
        tokens = min(float(burst), bucket.tokens + max(0.0, now - bucket.stamp) * rate)
        self._buckets[source] = bucket = Bucket(tokens, now)
        if tokens < 1.0:
            raise RequestRefused(
                f"{source} asks for too many adaptations: the limit for one source is {rate:g} a second, and {burst} "
                "at once (rate_limit and burst of the adaptation manager)",
                RefusalCode.THROTTLED,
                retry_after=math.ceil((1.0 - tokens) / rate * 1e3) / 1e3,
            )
        bucket.tokens -= 1.0
        if len(self._buckets) > MAX_SOURCES:
            del self._buckets[next(iter(self._buckets))]
