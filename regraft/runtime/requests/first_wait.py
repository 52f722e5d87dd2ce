"""The wait for the other side before the first message at a fresh key, which might reach nobody."""

from __future__ import annotations

import time

from regraft.runtime.data.writers import Writer

WAIT_AFTER_NOBODY = 0.01
NOBODY_FOR = 5.0
"""Seconds for which waits are so short after one that met nobody: the component's loop stands still meanwhile."""


class FirstWait:
    """Waits for up to ``usual`` seconds, less for a while after somebody has not come."""

    def __init__(self, usual: float) -> None:
        self._usual = usual
        self._hurried_until = 0.0

    def wait(self, writer: Writer) -> None:
        """Wait until somebody subscribes to a fresh key."""
        if not writer.fresh:
            return
        hurried = time.monotonic() < self._hurried_until
        if not writer.wait_for_reader(WAIT_AFTER_NOBODY if hurried else self._usual):
            self._hurried_until = time.monotonic() + NOBODY_FOR
