"""Processes, as the operating system shows them."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from tests.support.waiting import wait_until


def exists(pid: int) -> bool:
    """Tell whether a process is there and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_gone(pids: list[int]) -> None:
    """Wait until processes have ended."""
    wait_until(lambda: not any(exists(pid) for pid in pids), "all processes to end")


def parent_of(pid: int) -> int:
    """Return the process that started another, or adopted it."""
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


def children_of(pid: int) -> list[int]:
    """Return all descendants of a process."""
    parents: dict[int, int] = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                fields = Path(f"/proc/{entry}/stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            parents[int(entry)] = int(fields[1])
    found, before = {pid}, 0
    while len(found) != before:
        before = len(found)
        found |= {child for child, parent in parents.items() if parent in found}
    return sorted(found - {pid})


def send(pid: int, signum: int) -> None:
    """Send a signal to one process, or raise ProcessLookupError.

    A status shows process 0 while a component has none. A signal to 0 would end all tests, and what runs them.
    """
    assert pid > 0, f"there is no process: {pid}"
    os.kill(pid, signum)


def kill(pid: int) -> None:
    """End a process by force."""
    send(pid, signal.SIGKILL)


def stop(pid: int) -> None:
    """Stop a process as a debugger or a frozen machine does."""
    send(pid, signal.SIGSTOP)


def go_on(pid: int) -> None:
    """Continue a process that was stopped."""
    send(pid, signal.SIGCONT)
