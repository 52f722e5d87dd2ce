"""Everything that a process has started, and that what it has started has started: none of it is to stay behind.

A program can leave its group and its parent (``setsid``, a double fork). A subreaper (prctl(2)) becomes the parent of
every process below it that loses its own. So all of them can be found by their parents.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

PR_SET_CHILD_SUBREAPER, PR_GET_CHILD_SUBREAPER = 36, 37
END_TIMEOUT = 5.0
"""Seconds that killed processes may take to be gone."""
LOOK_INTERVAL = 0.01

RUN_VARIABLE = "REGRAFT_RUN"
"""The environment variable by which a program shows which run of a component has started it: ``NAME/INCARNATION``."""

_libc = ctypes.CDLL(None, use_errno=True)


def adopt_orphans(wanted: bool = True) -> None:
    """Become the parent of all that loses its parent below this process, or no longer."""
    _libc.prctl(PR_SET_CHILD_SUBREAPER, int(wanted))


def _adopts_orphans() -> bool:
    adopts = ctypes.c_int()
    _libc.prctl(PR_GET_CHILD_SUBREAPER, ctypes.byref(adopts))
    return bool(adopts.value)


def children_by_parent() -> dict[int, list[int]]:
    """Return all living processes by their parent."""
    found: dict[int, list[int]] = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            with contextlib.suppress(OSError, IndexError, ValueError):
                with open(f"/proc/{entry}/stat", "rb") as file:
                    state, parent = file.read().rpartition(b") ")[2].split(None, 2)[:2]
                if state not in b"ZX":
                    found.setdefault(int(parent), []).append(int(entry))
    return found


def descendants(*of: int) -> set[int]:
    """Return the living processes below some."""
    by_parent = children_by_parent()
    found: set[int] = set()
    waiting = [*of]
    while waiting:
        below = by_parent.get(waiting.pop(), ())
        waiting += [pid for pid in below if pid not in found]
        found |= set(below)
    return found


def end_descendants(but: frozenset[int] = frozenset()) -> bool:
    """Kill all that is below this process, but for some and what is below those; returns whether all are gone."""
    until = time.monotonic() + END_TIMEOUT
    killed: set[int] = set()
    while True:
        living = descendants(os.getpid()) - but - descendants(*but)
        if not living or time.monotonic() > until:
            _reap(killed)
            return not living
        for pid in living:
            kill(pid)
        killed |= living
        time.sleep(LOOK_INTERVAL)


def _reap(ended: set[int]) -> None:
    """Reap the children that this process has inherited: each holds a process number until then."""
    for pid in ended:
        with contextlib.suppress(ChildProcessError):
            os.waitpid(pid, os.WNOHANG)


def end_run(run: str, below: int) -> None:
    """Kill what a run of a component has started, and left behind under another parent."""
    shown = f"{RUN_VARIABLE}={run}".encode()
    for pid in descendants(below):
        with contextlib.suppress(OSError):
            if shown in Path(f"/proc/{pid}/environ").read_bytes().split(b"\0"):
                kill(pid)


def kill(pid: int) -> None:
    """Kill a process, unless it has ended or is not ours."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.kill(pid, signal.SIGKILL)


@contextlib.contextmanager
def nothing_left_behind() -> Iterator[None]:
    """At the end of the block, kill all processes that it left below this one; blocks may be nested."""
    before = frozenset(descendants(os.getpid()))
    adopted = _adopts_orphans()
    adopt_orphans()
    try:
        yield
    finally:
        end_descendants(but=before)
        adopt_orphans(wanted=adopted)
