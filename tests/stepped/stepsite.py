"""A whole system in step, on threads of one process."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from typing import Any

from regraft.bus.interface import Bus, Sample
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus.zenoh_bus import ZenohBus, open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.bus_schema.model.lifecycle import State
from regraft.client import Client
from regraft.component.component import Component
from regraft.lockstep.member import Member
from regraft.lockstep.source import SourceLoop, TimeSource
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.core.clock import SteppedClock
from regraft.runtime.data.writers import Identity, Writers
from regraft.runtime.runtime import Runtime
from tests.ports import free_endpoint
from tests.waiting import PATIENCE, wait_until


class StepSite:
    """Components in step on a memory or Zenoh bus."""

    def __init__(self, kind: str) -> None:
        self._hub = MemoryHub() if kind == "memory" else None
        self._router: ZenohBus | None = None
        if kind == "zenoh":
            self._endpoint = free_endpoint()
            self._router = open_bus(Endpoints(listen=(self._endpoint,), router=True), lockstep=True)
        self.runtimes: dict[str, Runtime] = {}
        self.threads: dict[str, threading.Thread] = {}
        self._buses: list[Bus] = []
        self.client = Client(self._session(), "steps", "tester")

    def _session(self) -> Bus:
        bus: Bus = MemoryBus(self._hub) if self._hub else open_bus(Endpoints(connect=(self._endpoint,)), lockstep=True)
        self._buses.append(bus)
        return bus

    def start(self, cls: type[Component], name: str, **assigned: Any) -> None:
        """Run a component on a thread of its own."""
        assigned = {"incarnation": 1, "heartbeat": 0.05, **assigned}
        assignment = Assignment("steps", name, f"{cls.__module__}:{cls.__qualname__}", simulated=True, **assigned)

        def run() -> None:
            clock = SteppedClock()
            runtime = Runtime(cls, assignment, self._session(), clock)
            self.runtimes[name] = runtime
            with contextlib.suppress(SystemExit):  # it is killed
                if isinstance(runtime.component, TimeSource):
                    SourceLoop(runtime, clock, runtime.component).run()
                else:
                    Member(runtime, clock).run()
            runtime.leave()

        self.threads[name] = threading.Thread(target=run, name=name, daemon=True)
        self.threads[name].start()

    def start_world(self, cls: type[TimeSource], members: tuple[str, ...], duration: float) -> None:
        """Run the time source at full speed, waiting for ``members``."""
        self.start(cls, "world", members=members, duration=duration, parameters={"speed": "max"})

    def told(self, right: Callable[[ClockTime], bool] = lambda _: True, what: str = "a first time") -> ClockTime:
        """Return the latest time that was told, once it is right: the first comes after the first tick."""
        wait_until(lambda: (t := self.client.clock()) is not None and right(t), what)
        told = self.client.clock()
        assert told is not None
        return told

    def wait_finished(self) -> ClockTime:
        """Wait for the end of the run."""
        return self.told(lambda t: t.finished, "the end of the run")

    def wait_for_time(self, seconds: float) -> None:
        """Wait until simulated time has come so far."""
        self.told(lambda t: t.time >= seconds * 1e9, f"{seconds} s")

    def publish(self, topic: str, message: object, source: str) -> None:
        """Put one message at a topic, as somebody who is no member."""
        writers = Writers(self._session(), SteppedClock(), Identity(source, 1, 1))
        writer = writers.open(f"steps/topic/{topic}", type_of(type(message)).encoding)
        assert writer.wait_for_reader(PATIENCE)
        writer.put(codec.encode(message))

    def listen(self, keys: str, heard: Callable[[Sample], object]) -> None:
        """Hand everything at ``keys`` on, in the order in which it comes."""
        bus = self._session()

        def open_and_hand_on(item: Any) -> None:
            sample = bus.open_sample(item)
            if sample is not None:
                heard(sample)

        bus.subscribe(keys, open_and_hand_on)

    def component(self, name: str) -> Any:
        """Return a component itself."""
        return self.runtimes[name].component

    def kill(self, name: str) -> None:
        """End a component at once, as its process does that is killed."""
        runtime = self.runtimes.pop(name)
        runtime.post(_die)
        self.threads[name].join(PATIENCE)
        runtime.bus.close()

    def another_client(self, name: str) -> Client:
        """Return a tool of its own session."""
        return Client(self._session(), "steps", name)

    def end(self, name: str) -> None:
        """Shut a component down and wait until it has left."""
        runtime = self.runtimes[name]
        runtime.post(lambda: runtime.lifecycle.reach(State.FINALIZED))
        self.threads[name].join(PATIENCE)
        assert not self.threads[name].is_alive()

    def close(self) -> None:
        """End everything, the world first."""
        for name in sorted(self.runtimes, key=lambda name: name != "world"):
            self.end(name)
        self.client.close()
        for bus in self._buses:
            bus.close()
        if self._router:
            self._router.close()


def _die() -> None:
    raise SystemExit
