"""A small system for a test: a hub in this process, components of the kit and bare ones as processes beside it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from types import TracebackType
from typing import Any, TypeVar

from regraft.bus.zenoh_bus import open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.protocol.control import ControlError, Snapshot
from regraft.component.component import class_path
from regraft.runtime.core.assignment import Assignment
from regraft.security.system_secret import fresh
from tests.support.machine.ports import free_endpoint
from tests.support.machine.processes import exists, send, wait_gone
from tests.support.nursery import Nursery
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE, wait_for

T = TypeVar("T")


class ControlRefused(Exception):
    """A control query was answered with an error."""

    def __init__(self, error: ControlError) -> None:
        self.error = error
        super().__init__(str(error))


class System:
    """The hub, and what runs beside it until the test ends."""

    def __init__(self, *, simulated: bool = False) -> None:
        self.simulated = simulated
        self.keys = Keys("small")
        self.endpoint = free_endpoint()
        self.secret = fresh()
        self.bus = open_bus(Endpoints((self.endpoint,), (), router=True, secret=self.secret), lockstep=simulated)
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self._nursery: Nursery | None = None
        self._forked: list[int] = []
        self.statuses: dict[str, list[ComponentStatus]] = {}
        self.bus.subscribe(self.keys.status("*"), self._take_status)

    def _take_status(self, item: Any) -> None:
        sample = self.bus.open_sample(item)
        if sample is not None:
            status = codec.decode(sample.payload, ComponentStatus)
            self.statuses.setdefault(status.component, []).append(status)

    def __enter__(self) -> System:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for process in self.processes.values():
            process.send_signal(signal.SIGTERM)
        for pid in filter(exists, self._forked):
            send(pid, signal.SIGTERM)
        for process in self.processes.values():
            try:
                process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        wait_gone(self._forked)
        if self._nursery:
            self._nursery.close()
        self.bus.close()

    def _assignment(self, name: str, cls: str, **more: Any) -> Assignment:
        made = Assignment(
            "small", name, cls, simulated=self.simulated, connect_endpoints=(self.endpoint,), secret=self.secret
        )
        return replace(made, **more)

    def kit(self, name: str, cls: type, **more: Any) -> None:
        """Start a component of the kit."""
        if self._nursery is None:
            self._nursery = Nursery(cls.__module__)
        self._forked.append(self._nursery.start(self._assignment(name, class_path(cls), **more)))

    def bare(self, name: str = "bare", checkpoint_file: str = "", **more: Any) -> None:
        """Start a bare component, as a host starts any program."""
        plain = {**codec.to_plain(self._assignment(name, "", **more)), "checkpoint_file": checkpoint_file}
        command = [sys.executable, "-m", "bare.bare_component"]
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "tests"), "REGRAFT_ASSIGNMENT": json.dumps(plain)}
        self.processes[name] = subprocess.Popen(command, stdin=subprocess.DEVNULL, env=environment)

    def status(self, name: str) -> ComponentStatus | None:
        """Return the latest status of a component."""
        told = self.statuses.get(name)
        return told[-1] if told else None

    def is_in(self, name: str, state: str) -> bool:
        """Tell whether a component's latest status says ``state``."""
        status = self.status(name)
        return status is not None and status.state.value == state

    def wait_for(self, state: str, *names: str) -> None:
        """Wait until all of these are in ``state``."""
        for name in names:
            wait_for(partial(self.is_in, name, state), f"{name} is {state}")

    def control(self, name: str, verb: str, message: object | None, reply: type[T]) -> T:
        """Ask a control query; raises ControlRefused."""
        payload = codec.encode(message) if message is not None else b""
        key = self.keys.control(name, 1, verb)
        answers = wait_for(lambda: self.bus.query(key, payload, PATIENCE / 3), f"{name} answers {verb}")
        if answers[0].error:
            raise ControlRefused(codec.decode(answers[0].payload, ControlError))
        return codec.decode(answers[0].payload, reply)

    def state_of(self, name: str) -> Any:
        """Return what a component's snapshot holds."""
        return self.control(name, "state", None, Snapshot).state
