"""The wait for the other side before the first message at a fresh key, which might reach nobody."""

from __future__ import annotations

import time

from regraft.runtime.data.writers import Writer

SHORTER = 4
SHORTER_FOR = 5.0
"""Divisor of the wait after each that met nobody, and the seconds after which it is the whole one again."""


class FirstWait:
    """Waits for up to ``usual`` seconds, and less, down to ``least``, after somebody has not come.

    The component's loop stands still meanwhile: with a ``least`` of 0 any number of waits takes less than twice one.
    """

    def __init__(self, usual: float, least: float = 0.0) -> None:
        self._usual = self._wait = usual
        self._least = least
        self._shorter_until = 0.0

    def wait(self, writer: Writer) -> None:
        """Wait until somebody subscribes to a fresh key."""
        if not writer.fresh:
            return
        if time.monotonic() > self._shorter_until:
            self._wait = self._usual
        if not writer.wait_for_reader(self._wait):
            self._wait = max(self._least, self._wait / SHORTER)
            self._shorter_until = time.monotonic() + SHORTER_FOR
