"""Where the contract suite runs: real components on threads of their own, on either bus, under the real clock."""

from __future__ import annotations

import threading
from typing import Any, TypeVar

from regraft.bus.interface import Bus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope, Kind
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.protocol.control import ComponentView, ParameterValues
from regraft.bus_schema.model.lifecycle import State
from regraft.client import Client
from regraft.component.component import Component, class_path
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.core.clock import RealClock
from regraft.runtime.data.writers import Identity, Writer, Writers
from regraft.runtime.runtime import Runtime
from tests.support.buses import Buses
from tests.support.machine.threads import ComponentThread
from tests.support.waiting import PATIENCE, wait_until

C = TypeVar("C", bound=Component)
M = TypeVar("M")

BEYOND = 65 * 1024 * 1024
"""Bytes: more than any message may have."""


class Site:
    """A bus with components on it."""

    def __init__(self, kind: str) -> None:
        self.keys = Keys("site")
        self._buses = Buses(kind)
        self.runtimes: dict[str, Runtime] = {}
        self._threads: dict[str, ComponentThread] = {}
        self.bus = self.session()
        self.client = Client(self.session(), "site", "tester")

    @property
    def endpoint(self) -> str:
        """Where its hub is; empty in memory."""
        return self._buses.endpoint

    def session(self) -> Bus:
        """Open another session."""
        return self._buses.session()

    def start(self, cls: type[C], name: str, **assigned: Any) -> C:
        """Run a component on a thread of its own; returns it once it has gone to its state."""
        assignment = Assignment("site", name, class_path(cls), **assigned)
        thread = ComponentThread(cls, assignment, self.session())
        thread.wait_started()
        self._threads[name] = thread
        self.runtimes[name] = thread.runtime
        token = self.keys.alive(name, assignment.incarnation)
        if thread.runtime.state is not State.FINALIZED:
            wait_until(lambda: self.bus.present(token, PATIENCE), f"{name}'s token")
        assert isinstance(thread.component, cls)
        return thread.component

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

    def cut_off(self, name: str) -> None:
        """Cut a component off from the bus, as a process is that is killed."""
        thread = self._threads.pop(name)
        thread.bus.close()
        del self.runtimes[name]
        thread.shut_down()
        thread.join()

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
        for thread in self._threads.values():
            thread.join()
            if thread.failure:
                raise thread.failure
        self.client.close()
        self._buses.close()
