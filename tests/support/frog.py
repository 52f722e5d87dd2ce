"""FROG, started as a user starts it."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import httpx

from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.sim_service.cameras.renderers import FORCE
from tests.support.commands import run
from tests.support.machine.ports import free_port
from tests.support.paths import FROG
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

M = TypeVar("M")


@dataclass(frozen=True, slots=True)
class Run:
    """How a run that ended by itself ended."""

    code: int
    summary: dict[str, Any]
    errors: str


def run_frog(home: Path, seconds: float, *options: str, renderer: str = "ray", stack: Path = FROG) -> Run:
    """Run FROG (or another stack of its folder) for simulated ``seconds`` and return what it says in the end.

    To find and start OpenGL takes longer than the few pictures of a short run; without a ``renderer`` FROG looks for
    the best.
    """
    environment = {**os.environ, "REGRAFT_HOME": str(home), FORCE: renderer}
    port = ["--set", f"gateway.port={free_port()}"]
    words = ("up", str(stack), "--for", f"{seconds:g}", "--json", "--headless", *port, *options)
    ended = run(*words, environment=environment, within=max(900.0, 3 * seconds), imported="frog")
    summary = json.loads(ended.stdout) if ended.stdout.strip() else {}
    return Run(ended.returncode, summary, ended.stderr)


class Frog(System):
    """A running FROG."""

    def __init__(self, folder: Path, *options: str, stack: Path = FROG) -> None:
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}/api/v1"
        words = ("--system", "tests", "--set", f"gateway.port={self.port}", *options)
        environment = {**os.environ, FORCE: "ray"}
        super().__init__(stack, *words, log=folder / "up.log", imported="frog", environment=environment)
        self.rest = httpx.Client(base_url=self.url, timeout=PATIENCE, verify=False)  # no TLS: certificates are not read
        try:
            wait_until(self._serving, "the gateway", 60.0)
            wait_until(lambda: self.states() == {"active"}, "everybody active", 60.0)
        except AssertionError:
            self.end()
            raise

    def _serving(self) -> bool:
        try:
            return self.rest.get("/system").status_code == 200
        except httpx.TransportError:
            return False

    def states(self) -> set[str]:
        """Return the lifecycle states that components are in."""
        return {seen.status.state.value for seen in self.client.components().values() if seen.status}

    def clock(self) -> ClockTime:
        """Return the latest time."""
        wait_until(lambda: self.client.clock() is not None)
        told = self.client.clock()
        assert told is not None
        return told

    def wait_for_time(self, seconds: float) -> None:
        """Wait until simulated time has gone on by ``seconds``."""
        self.wait_for_time_after(self.clock().time, seconds)

    def wait_for_time_after(self, start: int, seconds: float) -> None:
        """Wait until simulated time is ``seconds`` past ``start`` (nanoseconds)."""
        end = start + seconds * 1e9
        wait_until(lambda: self.clock().time >= end, f"{seconds} simulated seconds", 60.0)

    def listen(self, topic: str, cls: type[M]) -> list[M]:
        """Return a list that the messages of a topic are added to from now on."""
        heard: list[M] = []
        self.client.topic(topic, cls, lambda sample: heard.append(sample.message))
        return heard

    def adapt(self, *changes: dict[str, Any], **more: Any) -> httpx.Response:
        """Ask for an adaptation."""
        return self.rest.post("/adaptations", json={"changes": list(changes), **more})

    def end(self) -> int:
        """End it as Ctrl-C does."""
        self.rest.close()
        return super().end()


def speed_of(twist: Any) -> float:
    """Return the speed over ground of a Twist in m/s."""
    return math.hypot(twist.linear.x, twist.linear.y)


class Load:
    """Busy loops beside the test, as separate processes."""

    def __init__(self, count: int, *, apart: bool = False) -> None:
        """Start so many; ``apart`` from each other, each gets as much of the processors as all of the test."""
        loop = [sys.executable, "-c", "while True: pass"]
        # The kernel shares processors between sessions first (sched_autogroup).
        self._busy = [subprocess.Popen(loop, start_new_session=apart) for _ in range(count)]

    def __enter__(self) -> Load:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._busy:
            process.kill()
            process.wait()


def in_parallel(call: Callable[[], None]) -> threading.Thread:
    """Run something beside the test."""
    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    return thread


def pause(seconds: float) -> None:
    """Let wall-clock time pass where that is what is being tested."""
    time.sleep(seconds)
