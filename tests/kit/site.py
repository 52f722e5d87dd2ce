"""Where the contract suite runs: real components on threads of their own, on either bus, under the real clock."""

from __future__ import annotations

import threading
from typing import Any, TypeVar

from regraft.bus.interface import Bus
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus.zenoh_bus import ZenohBus, open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope, Kind
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.protocol.control import ComponentView, ParameterValues
from regraft.bus_schema.model.lifecycle import State
from regraft.client import Client
from regraft.component.component import Component
from regraft.runtime import loop
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.core.clock import RealClock
from regraft.runtime.data.writers import Identity, Writer, Writers
from regraft.runtime.runtime import Runtime
from tests.ports import free_endpoint
from tests.waiting import PATIENCE, wait_until

C = TypeVar("C", bound=Component)
M = TypeVar("M")

BEYOND = 65 * 1024 * 1024
"""Bytes: more than any message may have."""


class Site:
    """A bus with components on it."""

    def __init__(self, kind: str) -> None:
        self.keys = Keys("site")
        self._hub: MemoryHub | None = MemoryHub() if kind == "memory" else None
        self._router: ZenohBus | None = None
        if kind == "zenoh":
            self._endpoint = free_endpoint()
            self._router = open_bus(Endpoints(listen=(self._endpoint,), router=True))
        self.runtimes: dict[str, Runtime] = {}
        self._threads: list[threading.Thread] = []
        self._buses: list[Bus] = []
        self._failures: list[BaseException] = []
        self.bus = self.session()
        self.client = Client(self.session(), "site", "tester")

    def session(self) -> Bus:
        """Open another session."""
        bus: Bus = MemoryBus(self._hub) if self._hub else open_bus(Endpoints(connect=(self._endpoint,)))
        self._buses.append(bus)
        return bus

    def start(self, cls: type[C], name: str, **assigned: Any) -> C:
        """Run a component on a thread of its own; returns it once it has gone to its state."""
        assignment = Assignment("site", name, f"{cls.__module__}:{cls.__qualname__}", **assigned)
        started = threading.Event()
        failure = self._failures

        def run() -> None:
            try:
                runtime = Runtime(cls, assignment, self.session(), RealClock())
                self.runtimes[name] = runtime
                runtime.post(started.set)
                loop.run(runtime)
                runtime.leave()
            except BaseException as error:
                failure.append(error)
                started.set()

        thread = threading.Thread(target=run, name=name, daemon=True)
        thread.start()
        self._threads.append(thread)
        assert started.wait(PATIENCE)
        if failure:
            raise failure.pop()
        token = self.keys.alive(name, assignment.incarnation)
        if self.runtimes[name].state is not State.FINALIZED:
            wait_until(lambda: self.bus.present(token, PATIENCE), f"{name}'s token")
        component = self.runtimes[name].component
        assert isinstance(component, cls)
        return component

    def status(self, name: str) -> ComponentStatus:
        """Return what a component last said of itself."""
        status = self.client.components()[name].status
        assert status is not None
        return status

    def set_parameters(self, name: str, values: dict[str, Any], term: int | None = None) -> ComponentView:
        """Set parameters by a control query."""
        view = self.client.control(name, "parameters", ParameterValues(values, term))
        assert isinstance(view, ComponentView)
        return view

    def stop(self, name: str) -> None:
        """Shut a component down."""
        runtime = self.runtimes[name]
        runtime.post(lambda: runtime.lifecycle.reach(State.FINALIZED))

    def writer(self, topic: str, message: type, source: str = "source", incarnation: int = 1) -> Writer:
        """Return a writer that puts under any name and incarnation."""
        writers = Writers(self.session(), RealClock(), Identity(source, incarnation, incarnation))
        return writers.open(self.keys.topic(topic), type_of(message).encoding)

    def collect(self, topic: str, cls: type[M]) -> list[M]:
        """Return a list that the messages of a topic are added to from now on."""
        collected: list[M] = []
        listening = threading.Event()
        bus = self.session()

        def take(item: Any) -> None:
            sample = bus.open_sample(item)
            if sample is None:
                return
            if Envelope.from_bytes(sample.attachment).kind is Kind.DATA:
                collected.append(codec.decode(sample.payload, cls))
            else:
                listening.set()

        bus.subscribe(self.keys.topic(topic), take)
        probe = self.writer(topic, cls, "probe")
        while not listening.wait(0.01):
            probe.mark()
        return collected

    def close(self) -> None:
        """End everything."""
        for name in self.runtimes:
            self.stop(name)
        if self._failures:
            raise self._failures[0]
        for thread in self._threads:
            thread.join(PATIENCE)
            assert not thread.is_alive(), f"{thread.name} did not end"
        self.client.close()
        for bus in self._buses:
            bus.close()
        if self._router:
            self._router.close()
