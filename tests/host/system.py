"""A system started with the project's own command, as a user starts it."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from regraft import CallFailed, run_directory
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus
from regraft.client import Client
from tests.waiting import PATIENCE, wait_until

ROOT = Path(__file__).parents[2]
ATTEMPTS = 5


class System:
    """``regraft up`` in a process of its own."""

    def __init__(self, stack: Path, *options: str, log: Path | None = None) -> None:
        self.log = log or stack.parent / "up.log"
        with self.log.open("wb") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "regraft.cli", "up", str(stack), "--headless", *options],
                stdout=output,
                stderr=output,
                stdin=subprocess.DEVNULL,
                cwd=ROOT,
            )
        self.events: list[Event] = []
        self.info: run_directory.RunInfo
        try:
            wait_until(self._is_up, "the system to be up")
        except AssertionError:
            self.process.kill()
            self.process.wait()
            raise
        self.info = run_directory.find("tests")
        self.client = Client.connect(self.info)
        self.client.events(self.events.append)

    def _is_up(self) -> bool:
        if self.process.poll() is not None:
            raise AssertionError(self.log.read_text())
        return bool(run_directory.running())

    def processes(self) -> dict[str, ProcessStatus]:
        """Return the host's view of its processes."""
        hosts = self.client.hosts()
        status = hosts["local"].status if "local" in hosts else None
        return {process.component: process for process in status.processes} if status else {}

    def wait_for(self, name: str, right: Callable[[ProcessStatus], Any], what: str) -> ProcessStatus:
        """Wait until a component's process is as wanted."""

        def holds() -> bool:
            process = self.processes().get(name)
            return process is not None and bool(right(process))

        wait_until(holds, f"{name}: {what}")
        return self.processes()[name]

    def wait_running(self, name: str, incarnation: int = 1) -> ProcessStatus:
        """Wait until a run of a component is up."""
        return self.wait_for(
            name, lambda p: p.state is ProcessState.RUNNING and p.incarnation >= incarnation and p.pid, "running"
        )

    def ask_until_it_ends(self, name: str, ask: Callable[[], object]) -> None:
        """Ask what ends a component's run and is never answered; again if the question did not come through."""
        run = self.processes()[name]

        def over() -> bool:
            now = self.processes()[name]
            return now.incarnation != run.incarnation or now.state is not ProcessState.RUNNING

        for _ in range(ATTEMPTS):
            with contextlib.suppress(CallFailed):
                ask()
                raise AssertionError(f"{name} has answered")
            with contextlib.suppress(AssertionError):
                wait_until(over, f"the end of {name}", PATIENCE / ATTEMPTS)
                return
        raise AssertionError(f"{name} has not ended")

    def said(self, kind: str, subject: str) -> list[Event]:
        """Return the events of a kind about somebody."""
        return [event for event in self.events if event.kind == kind and event.subject == subject]

    def end(self) -> int:
        """End it as Ctrl-C does; returns the exit code."""
        self.client.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return self.process.wait(PATIENCE)


def exists(pid: int) -> bool:
    """Tell whether a process is there and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_gone(pids: list[int]) -> None:
    """Wait until processes have ended."""
    wait_until(lambda: not any(exists(pid) for pid in pids), "all processes to end")


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


def now() -> float:
    """Return monotonic seconds."""
    return time.monotonic()
