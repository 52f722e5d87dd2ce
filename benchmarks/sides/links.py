"""A hub in this process, and others around it: the processes of both sides use the same kind of links."""

from __future__ import annotations

import time
from collections.abc import Callable
from multiprocessing.context import SpawnProcess
from types import TracebackType
from typing import Any

from benchmarks.sides.processes import Processes
from regraft.bus.zenoh_bus import ZenohBus, open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.client import Client
from regraft.component.component import Component, class_path
from regraft.patience import Patience
from regraft.process.main import run_component
from regraft.runtime.core.assignment import Assignment
from regraft.security.system_secret import fresh
from regraft.system.launch import free_endpoint

SYSTEM = "bench"
UP_TIMEOUT = 20.0


class Site:
    """A router session here, and processes that are its clients, as on a host."""

    def __init__(self) -> None:
        self.endpoint, self.secret = free_endpoint(), fresh()
        self.hub = open_bus(Endpoints((self.endpoint,), router=True, secret=self.secret))
        self.link = Endpoints(connect=(self.endpoint,), secret=self.secret)
        self.bus: ZenohBus = open_bus(self.link)
        self.client = Client(self.bus, SYSTEM, "bench")
        self._processes = Processes()

    def __enter__(self) -> Site:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._processes.end()
        self.client.close()
        self.bus.close()
        self.hub.close()

    def spawn(self, function: Callable[..., object], *arguments: Any) -> SpawnProcess:
        """Run a function in a fresh process."""
        return self._processes.spawn(function, *arguments)

    def component(self, cls: type[Component], name: str, **assigned: Any) -> SpawnProcess:
        """Run a component in a process of its own."""
        assignment = Assignment(
            SYSTEM, name, class_path(cls), connect_endpoints=(self.endpoint,), secret=self.secret, **assigned
        )
        return self.spawn(run_component, assignment)

    def wait_for_components(self, *names: str) -> None:
        """Wait until components are active; raises TimeoutError."""

        def active() -> bool:
            seen = self.client.components()
            states = [seen[name].status for name in names if name in seen]
            return sum(status is not None and status.state.value == "active" for status in states) == len(names)

        wait_until(active, f"{', '.join(names)} active")

    def wait_for_token(self, key: str) -> None:
        """Wait until a liveliness token is there; raises TimeoutError."""
        wait_until(lambda: self.bus.present(key, 1.0), key)


def wait_until(condition: Callable[[], object], what: str, seconds: float = UP_TIMEOUT) -> None:
    """Wait for a condition; raises TimeoutError after ``seconds``, which last longer on a crowded machine."""
    patience = Patience(seconds)
    while not condition():
        if patience.is_over():
            raise TimeoutError(f"not within {seconds:g} s: {what}")
        time.sleep(0.005)
