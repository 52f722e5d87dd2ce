"""A component's own lease: until when it may act without a word from its host.

A joined host that loses the system ends its components, since they may be started elsewhere. But a host can be frozen,
and cannot end them then. So they end themselves: the host writes into a file until when they may act, and each of them
reads it. The clock continues while a machine or a process is frozen.

The file is in memory and has no name: on a busy disk the host would wait as it writes, on a full one it could not.
Both see it as one number, which is written and read as a whole: ``struct`` clears its target before it
writes, and a component that looked just then would take its lease for over.
"""

from __future__ import annotations

import mmap
import os
import signal
import struct
import threading
import time

UNTIL = struct.Struct("d")
"""The file: seconds of the clock below, infinite while there is no end."""
LOOK_INTERVAL = 0.1
"""Seconds between two looks at a lease without an end: it can get one at any time."""
STANDARD_ERROR = 2
GRACE = 0.25
"""Seconds that the host has for ending its components itself before they do."""


def now() -> float:
    """Return seconds of a clock that continues while the machine sleeps."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


class GrantedLease:
    """The host's side: the file, which it keeps open."""

    def __init__(self, name: str, until: float) -> None:
        """Grant a lease to a component; raises OSError."""
        self._until = until
        self._descriptor = os.memfd_create(f"lease of {name}")
        self.path = f"/proc/{os.getpid()}/fd/{self._descriptor}"
        """The file, for this machine's processes, as long as this one lives."""
        os.pwrite(self._descriptor, UNTIL.pack(until), 0)
        try:
            self._mapped = mmap.mmap(self._descriptor, UNTIL.size)
        except OSError:
            os.close(self._descriptor)
            raise
        self._file = memoryview(self._mapped).cast("d")

    def extend(self, until: float) -> None:
        """Have it end at another time."""
        if until != self._until:
            self._until = until
            self._file[0] = until

    def close(self) -> None:
        """Keep it open no longer: nobody holds it."""
        self._file.release()
        self._mapped.close()
        os.close(self._descriptor)


class HeldLease:
    """The component's side."""

    def __init__(self, name: str, path: str) -> None:
        """Hold the lease in the file at ``path``; raises OSError, ValueError."""
        self._name = name
        with open(path, "rb") as file:
            mapped = mmap.mmap(file.fileno(), UNTIL.size, access=mmap.ACCESS_READ)
        self._file = memoryview(mapped).cast("d")
        threading.Thread(target=self._watch, name="lease", daemon=True).start()

    def check(self) -> None:
        """Continue if the lease holds; else end this process at once, before it does anything more."""
        if now() > self._file[0]:
            self._end()

    def _watch(self) -> None:
        while True:
            self.check()
            time.sleep(min(LOOK_INTERVAL, max(0.001, self._file[0] - now())))

    def _end(self) -> None:
        line = f"{self._name} ends itself: its host has lost the system, and it may be started elsewhere\n"
        try:
            os.write(STANDARD_ERROR, line.encode())
        finally:  # also on a full disk: it may be started elsewhere by now
            os.kill(os.getpid(), signal.SIGKILL)
