"""Measures over time: a value that holds until the next, its mean and its integral over seconds."""

from __future__ import annotations

import math
from dataclasses import dataclass


class Unknown(Exception):
    """The value of a quality is unknown; the text states why. Authors may raise it in `measure`."""


@dataclass(frozen=True, slots=True)
class Metric:
    """A measurement.

    Attributes:
        value: The measure, None while it is unknown.
        time: When the data behind it were true, in seconds of the tree's clock.
        reason: Why it is unknown, empty if it is known.
    """

    value: float | None
    time: float
    reason: str = ""

    @property
    def is_valid(self) -> bool:
        """Whether something may be decided on it."""
        return self.value is not None


class MeanOverTime:
    """The mean of a value over the seconds for which it was known.

    A value holds until the next one. So a mean is independent of the rate of ticks: a second's measure weighs ten times
    that of a tenth. While the value is unknown nothing is counted.
    """

    def __init__(self) -> None:
        self._sum = 0.0
        self._seconds = 0.0
        self._value: float | None = None
        self._since = 0.0
        self._latest: float | None = None

    def hold(self, value: float | None, now: float) -> None:
        """Take the value that holds from now (s) on; None: it is unknown, or nobody measures."""
        if self._value is not None:
            self._sum += self._value * (now - self._since)
            self._seconds += now - self._since
        self._value, self._since = value, now
        if value is not None:
            self._latest = value

    @property
    def value(self) -> float | None:
        """The mean up to the last call; before the first value has held for any time, that value."""
        mean = self._sum / self._seconds if self._seconds > 0.0 else self._latest
        return mean if mean is None or math.isfinite(mean) else None


class Integral:
    """The integral of a value over time, such as the energy (J) of a power (W); the value holds until the next one.

    Values before the first one are taken to be like it. A gap longer than is bridged leaves the integral unknown:
    it would be a number that is wrong by nobody knows how much.
    """

    def __init__(self, since: float, longest_gap: float = math.inf) -> None:
        """Begin at a time (s), bridging gaps up to so many seconds."""
        self._longest_gap = longest_gap
        self._time = since
        self._value: float | None = None
        self._gap = 0.0
        self._total = 0.0

    def add(self, value: float, now: float) -> float:
        """Take the value that holds from now (s) on; returns the integral up to now.

        Raises:
            Unknown: there was a gap that is too long.
        """
        seconds = now - self._time
        self._gap = max(self._gap, seconds)
        if self._gap > self._longest_gap:
            raise Unknown(f"its integral has a gap of more than {self._longest_gap:g} s")
        self._total += (value if self._value is None else self._value) * seconds
        self._time, self._value = now, value
        return self._total
