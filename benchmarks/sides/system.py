"""A system under ``regraft up``, in a process of its own and a home of its own, as a user starts it."""

from __future__ import annotations

import os
import signal
import subprocess
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import TypeVar

from benchmarks.sides.links import wait_until
from regraft import run_directory
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.protocol.host import ProcessStatus
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Change, Outcome
from regraft.client import Client
from regraft.process.own_python import own_environment, own_python

R = TypeVar("R")
ROOT = Path(__file__).parents[2]
SYSTEM = "bench"
END_TIMEOUT = 20.0
ADAPT_TIMEOUT = 15.0
HEAD = f"""
system: {SYSTEM}
clock: real
imports: [benchmarks.sides.counting]
topics:
  adaptations: {{type: regraft/AdaptationReport}}
  architecture: {{type: regraft/Architecture}}
"""
MANAGER = """
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite, rate_limit: 10000, burst: 10000}
"""


class System:
    """Started on entering, ended on leaving. ``begun`` is when the command was given, in monotonic seconds."""

    def __init__(self, topics: str, components: str, hosts: tuple[str, ...] = ()) -> None:
        self._home = tempfile.TemporaryDirectory(prefix="regraft-bench-")
        self._folder = Path(self._home.name)
        (self._folder / "stack.yaml").write_text(
            f"{HEAD}{topics}\nhosts: [{', '.join(hosts)}]\ncomponents:{components}"
        )
        self.events: list[tuple[float, Event]] = []

    def __enter__(self) -> System:
        """Start it, and join as a client; raises TimeoutError if it is not up in time."""
        os.environ["REGRAFT_HOME"] = self._home.name
        self.begun = time.monotonic()
        with (self._folder / "up.log").open("wb") as log:
            self._process = subprocess.Popen(
                own_python("-m", "regraft.cli", "up", str(self._folder), "--headless"),
                stdout=log,
                stderr=log,
                stdin=subprocess.DEVNULL,
                cwd=ROOT,
                env=own_environment(),
            )
        wait_until(self._is_up, "the system is up")
        self.info = run_directory.find(SYSTEM)
        self.client = Client.connect(self.info, "bench")
        self.client.events(lambda event: self.events.append((time.monotonic(), event)))
        return self

    def _is_up(self) -> bool:
        if self._process.poll() is not None:
            raise RuntimeError(f"regraft up ended: {(self._folder / 'up.log').read_text()}")
        return bool(run_directory.running())

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if hasattr(self, "client"):
            self.client.close()
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(END_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        del os.environ["REGRAFT_HOME"]
        self._home.cleanup()

    def wait_for_components(self, *names: str) -> None:
        """Wait until components are active."""

        def active() -> bool:
            seen = self.client.components()
            states = [seen[name].status for name in names if name in seen]
            return sum(status is not None and status.state.value == "active" for status in states) == len(names)

        wait_until(active, f"{', '.join(names)} active")

    def processes(self) -> dict[str, ProcessStatus]:
        """Return the host's view of its processes, as it told it last."""
        hosts = self.client.hosts()
        status = hosts["local"].status if "local" in hosts else None
        return {process.component: process for process in status.processes} if status else {}

    def call(self, service: str, request: object, reply: type[R]) -> R:
        """Ask a service."""
        return self.client.call(service, request, reply, ADAPT_TIMEOUT)

    def adapt(self, *changes: Change) -> AdaptationReport:
        """Have the adaptation manager apply changes; raises RuntimeError unless it does."""
        report = self.call("adaptation_manager/adapt", AdaptationRequest(changes, reason="benchmark"), AdaptationReport)
        if report.outcome is not Outcome.APPLIED:
            raise RuntimeError(f"the adaptation was not applied: {report}")
        return report
