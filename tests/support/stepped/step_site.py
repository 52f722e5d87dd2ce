"""A whole system in step, on threads of one process."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.client import Client
from regraft.component.component import Component, class_path
from regraft.lockstep.source import TimeSource
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.core.clock import SteppedClock
from regraft.runtime.data.writers import Identity, Writers
from regraft.runtime.runtime import Runtime
from tests.support.buses import Buses
from tests.support.machine.threads import ComponentThread
from tests.support.waiting import PATIENCE, wait_until


class StepSite:
    """Components in step on a memory or Zenoh bus."""

    def __init__(self, kind: str) -> None:
        self._buses = Buses(kind, lockstep=True)
        self.runtimes: dict[str, Runtime] = {}
        self.threads: dict[str, ComponentThread] = {}
        self.client = Client(self._buses.session(), "steps", "tester")

    def start(self, cls: type[Component], name: str, **assigned: Any) -> None:
        """Run a component on a thread of its own."""
        assigned = {"incarnation": 1, "heartbeat": 0.05, **assigned}
        assignment = Assignment("steps", name, class_path(cls), simulated=True, **assigned)

        def built(runtime: Runtime) -> None:
            self.runtimes[name] = runtime

        self.threads[name] = ComponentThread(cls, assignment, self._buses.session(), built=built)

    def start_world(self, cls: type[TimeSource], members: tuple[str, ...], duration: float, **assigned: Any) -> None:
        """Run the time source at full speed, waiting for ``members``."""
        self.start(cls, "world", members=members, duration=duration, parameters={"speed": "max"}, **assigned)

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
        writers = Writers(self._buses.session(), SteppedClock(), Identity(source, 1, 1))
        writer = writers.open(f"steps/topic/{topic}", type_of(type(message)).encoding)
        assert writer.wait_for_reader(PATIENCE)
        writer.put(codec.encode(message))

    def listen(self, keys: str, heard: Callable[[Sample], object]) -> None:
        """Hand everything at ``keys`` on, in the order in which it comes."""
        bus = self._buses.session()

        def open_and_hand_on(item: Any) -> None:
            sample = bus.open_sample(item)
            if sample is not None:
                heard(sample)

        bus.subscribe(keys, open_and_hand_on)

    def serve(self, key: str, answer: Callable[[bytes], object]) -> None:
        """Answer queries at a key by what ``answer`` makes of them."""
        bus = self._buses.session()

        def open_and_answer(item: Any) -> None:
            query = bus.open_query(item)
            if query is not None:
                query.reply(codec.encode(answer(query.payload)))

        bus.serve(key, open_and_answer)

    def component(self, name: str) -> Any:
        """Return a component itself."""
        return self.runtimes[name].component

    def kill(self, name: str) -> None:
        """End a component at once, as its process does that is killed."""
        del self.runtimes[name]
        self.threads[name].kill()

    def cut_off(self, name: str) -> None:
        """Cut a component off from the bus for good."""
        del self.runtimes[name]
        self.threads[name].bus.close()

    def another_client(self, name: str) -> Client:
        """Return a tool of its own session."""
        return Client(self._buses.session(), "steps", name)

    def end(self, name: str) -> None:
        """Shut a component down and wait until it has left."""
        self.threads[name].end()

    def close(self) -> None:
        """End everything, the world first."""
        for name in sorted(self.runtimes, key=lambda name: name != "world"):
            self.end(name)
        self.client.close()
        self._buses.close()
