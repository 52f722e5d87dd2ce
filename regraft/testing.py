"""For tests of components: several in one process, without Zenoh, under a clock that the test moves.

>>> from regraft import Component, Output, every
>>> from regraft.bus_schema.messages.sensors import LightLevel
>>> class Lamp(Component):
...     "Publishes how dark it is."
...     level = Output(LightLevel)
...     @every(hz=2)
...     def measure(self) -> None:
...         self.level.publish(LightLevel(self.kit.now(), 0.5))
>>> with Rig() as rig:
...     lamp = rig.add(Lamp)
...     levels = rig.collect("level", LightLevel)
...     rig.advance(2.0)
...     len(levels)
4
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import TracebackType
from typing import Any, TypeVar

from regraft.bus.inbox import Inbox
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope, Kind
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus, Event
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.component import Component
from regraft.component.goal import Goal
from regraft.runtime import loop
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.core.clock import SteppedClock
from regraft.runtime.core.timers import Timers
from regraft.runtime.data.inbound import Inbound
from regraft.runtime.data.status_reporter import StatusReporter
from regraft.runtime.data.writers import Identity, Writers
from regraft.runtime.requests.request_client import RequestClient
from regraft.runtime.runtime import Runtime

__all__ = ["Rig"]

C = TypeVar("C", bound=Component)
M = TypeVar("M")
A = TypeVar("A")

FAULT = "component.fault"
MAX_TEXT = 10_000
"""Characters of a fault's text that are shown."""
FINEST = 1_000_000
"""Nanoseconds by which the clock moves at the least."""
HEAVY_WORK_TIMEOUT = 10.0


def _line(component: str, text: str) -> str:
    """Return a fault in words; an event cuts a text that is very long."""
    return f"{component}: {text[:MAX_TEXT]}"


class Rig:
    """Components on a memory bus, under one clock; the test is their surroundings.

    Its ``with`` block ends with AssertionError if an author's method has raised. A test that expects that takes it by
    ``take_faults``.
    """

    def __init__(self, system: str = "rig", *, seed: int = 0, start: float = 0.0) -> None:
        """Begin without components, at ``start`` seconds."""
        self.hub = MemoryHub()
        self.bus = MemoryBus(self.hub)
        self.clock = SteppedClock(round(start * 1e9))
        self.keys = Keys(system)
        self.events: list[Event] = []
        self._faults: list[str] = []
        self._taken: set[str] = set()
        self.runtimes: dict[str, Runtime] = {}
        self._system = system
        self._seed = seed
        self._inbox = Inbox()
        identity = Identity("rig", 1, 1)
        self._writers = Writers(self.bus, self.clock, identity)
        self._timers = Timers()
        self._reporter = StatusReporter(self.bus, self.keys, self.clock, identity, 3600.0)
        self._reporter.on_fault = partial(self._take_fault, identity.name)
        self._inbound = Inbound(self.clock, stepped=False)
        self._requests = RequestClient(self.keys, "rig-1", self._writers, self._timers, self._reporter)
        self._inbound.add(self.keys.reply("**", "rig-1"), self._requests)
        self.bus.subscribe(self.keys.reply("**", "rig-1"), self._inbox.put)
        self.bus.subscribe(self.keys.event, self._take_event)

    def __enter__(self) -> Rig:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for runtime in self.runtimes.values():
            runtime.leave()
        self.bus.close()
        if kind is None and (faults := self.take_faults()):
            raise AssertionError("\n".join(("the test has not expected these faults:", *dict.fromkeys(faults))))

    def _take_event(self, sample: Any) -> None:
        event = codec.decode(sample.payload, Event)
        self.events.append(event)
        if event.kind == FAULT and _line(event.subject, event.text) not in self._taken:
            self._faults.append(_line(event.subject, event.text))

    def _take_fault(self, component: str, text: str) -> None:
        """Take a fault as it is reported: of equal ones within seconds, only the first is an event."""
        self._faults.append(_line(component, text))
        self._taken.add(_line(component, text))

    def take_faults(self) -> list[str]:
        """Return what authors' methods have raised since the last call, in words: each component, where, and what."""
        faults, self._faults = self._faults, []
        return faults

    def add(
        self,
        cls: type[C],
        name: str | None = None,
        parameters: Mapping[str, Any] | None = None,
        connections: Mapping[str, str | None] | None = None,
        *,
        state: State = State.ACTIVE,
        scope: str = "",
    ) -> C:
        """Start a component and bring it to ``state``, as one of the robot ``scope`` if any; returns the component.

        Raises ValueError if there is one of this name: it would no longer be carried out.
        """
        name = name or cls.__name__.lower()
        if name in self.runtimes:
            raise ValueError(f"there is a component {name!r} already: give a name, or take it out of Rig.runtimes")
        assignment = Assignment(
            self._system,
            name,
            f"{cls.__module__}:{cls.__qualname__}",
            parameters=dict(parameters or {}),
            connections=dict(connections or {}),
            state=state,
            seed=self._seed,
            heartbeat=3600.0,
            scope=scope,
        )
        runtime = Runtime(cls, assignment, MemoryBus(self.hub), self.clock)
        self.runtimes[assignment.name] = runtime
        runtime.reporter.on_fault = partial(self._take_fault, assignment.name)
        loop.start(runtime)
        self.settle()
        component = runtime.component
        assert isinstance(component, cls)
        return component

    def state(self, name: str) -> State:
        """Return a component's lifecycle state."""
        return self.runtimes[name].state

    def status(self, name: str) -> ComponentStatus:
        """Return what a component reports about itself."""
        return self.runtimes[name].reporter.status

    def transition(self, name: str, transition: Transition) -> None:
        """Bring a component to another state; raises TransitionFailed."""
        self.runtimes[name].lifecycle.perform(transition)
        self.settle()

    def publish(self, topic: str, message: object) -> None:
        """Put a message on a topic and let everybody handle it."""
        self._writers.open(self.keys.topic(topic), type_of(type(message)).encoding).put(codec.encode(message))
        self.settle()

    def collect(self, topic: str, cls: type[M]) -> list[M]:
        """Return a list to which every message of a topic is added from now on."""
        collected: list[M] = []

        def take(sample: Any) -> None:
            if Envelope.from_bytes(sample.attachment).kind is Kind.DATA:
                collected.append(codec.decode(sample.payload, cls))

        self.bus.subscribe(self.keys.topic(topic), take)
        return collected

    def collect_qualities(self, component: str) -> list[MeasuredQualities]:
        """Return a list to which all that a component measures of its qualities is added from now on."""
        collected: list[MeasuredQualities] = []
        key = self.keys.qualities(component)
        self.bus.subscribe(key, lambda sample: collected.append(codec.decode(sample.payload, MeasuredQualities)))
        return collected

    def call(self, service: str, request: object, reply: type[A], *, timeout: float = 5.0) -> A:
        """Call a service, letting time pass until it answers; raises CallFailed."""
        outcome = self._requests.call(service, request, reply, timeout)
        self.advance_until(lambda: outcome.done, timeout + 1.0)
        if outcome.error:
            raise outcome.error
        assert outcome.value is not None
        return outcome.value

    def goal(self, service: str, goal: object, result: type[A], feedback: type[M] | None = None) -> Goal[A, M]:
        """Give an action a goal; let time pass with ``advance``."""
        given = self._requests.goal(service, goal, result, feedback)
        self.settle()
        return given

    def advance(self, seconds: float) -> None:
        """Let time pass, from one thing that is due to the next."""
        end = self.clock.now() + round(seconds * 1e9)
        while self.clock.now() < end:
            due = [d for d in (r.timers.next_due() for r in self.runtimes.values()) if d is not None]
            mine = self._timers.next_due()
            following = min([*due, *([mine] if mine is not None else []), end])
            self.clock.advance_to(max(following, min(end, self.clock.now() + FINEST)))
            self.settle()

    def advance_until(self, holds: Callable[[], bool], timeout: float = 100.0) -> None:
        """Let time pass until something ``holds``, looked at each 10 ms; raises TimeoutError after ``timeout`` (s)."""
        end = self.clock.now() + round(timeout * 1e9)
        self.settle()
        while not holds():
            if self.clock.now() >= end:
                raise TimeoutError(f"what was waited for did not hold within {timeout:g} s of the test's time")
            self.advance(0.01)

    def settle(self) -> None:
        """Let everybody handle what has arrived and what is due, until nothing is left to do."""
        busy = True
        while busy:
            busy = self._settle_mine()
            for runtime in list(self.runtimes.values()):
                busy = self._settle_one(runtime) or busy

    def _settle_mine(self) -> bool:
        self._timers.wake_sleepers(self.clock.now())
        item = self._inbox.get(0.0)
        busy = item is not None
        while item is not None:
            self._inbound.arrive(item)
            item = self._inbox.get(0.0)
        while self._inbound.ready:
            consumer, sample = self._inbound.ready.popleft()
            consumer.deliver(sample)
        return busy

    @staticmethod
    def _settle_one(runtime: Runtime) -> bool:
        item = runtime.inbox.get(HEAVY_WORK_TIMEOUT if runtime.compute.under_way else 0.0)
        busy = item is not None
        while item is not None:
            runtime.take(item)
            runtime.work()
            item = runtime.inbox.get(0.0)
        loop.pump(runtime)
        return busy or bool(runtime.compute.under_way)
