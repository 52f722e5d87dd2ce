"""A client's view of components and hosts: their latest status, and how long ago that was."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.bus_schema.messages.protocol.host import HostStatus, OtherHost, ProcessStatus
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.hosts.offers import NO_OFFER, HostOffer
from regraft.bus_schema.model.lifecycle import State

K = TypeVar("K")
V = TypeVar("V")

MAX_NAMES = 1000
MAX_RUNS = 8
"""Components, and runs of each, whose status is kept: those heard of last."""

Heard = tuple[ComponentStatus, float]


@dataclass(frozen=True, slots=True)
class ComponentSeen:
    """A component as seen from outside; of one that nobody has seen, the name alone is known.

    ``alive``: one of its runs is on the bus now. ``age``: seconds since its last status, None without one.
    ``host`` and ``process`` are None for a component that no host has reported.
    """

    name: str
    alive: bool = False
    status: ComponentStatus | None = None
    age: float | None = None
    host: str | None = None
    process: ProcessStatus | None = None

    @property
    def state(self) -> State | None:
        """The lifecycle state of its last status, None without one."""
        return self.status.state if self.status else None

    @property
    def error(self) -> str:
        """The error of its last status, empty without one."""
        return self.status.error if self.status else ""

    @property
    def failure(self) -> str:
        """Why it failed by itself, empty if it did not, or has recovered."""
        return self.status.failure if self.status else ""

    @property
    def detail(self) -> str:
        """The text of its last status, empty without one."""
        return self.status.detail if self.status else ""

    @property
    def values(self) -> dict[str, PlainValue]:
        """The values of its last status, empty without one."""
        return self.status.values if self.status else {}


@dataclass(frozen=True, slots=True)
class HostSeen:
    """A host as seen from outside; ``age`` is the seconds since its last status.

    ``state`` is how the first host sees it, None for the first host itself. ``processes`` are those that it runs,
    or was to run if it is not there. ``offer`` is what it offered itself when it joined.
    """

    name: str
    alive: bool
    status: HostStatus | None
    age: float | None
    state: HostState | None = None
    processes: tuple[ProcessStatus, ...] = ()
    offer: HostOffer = NO_OFFER


class Board:
    """The latest status of everybody. Any thread may write it, and read it."""

    def __init__(self) -> None:
        """Start empty."""
        self._changed = threading.Condition()
        self._components: dict[str, dict[int, Heard]] = {}
        self._hosts: dict[str, tuple[HostStatus, float]] = {}
        self._clock: ClockTime | None = None
        self._measured: dict[str, MeasuredQualities] = {}

    def take_component(self, status: ComponentStatus) -> None:
        """Note the status of a run of a component: which one speaks for it, its liveliness token decides later."""
        with self._changed:
            runs = self._components.pop(status.component, {})
            runs.pop(status.incarnation, None)
            runs[status.incarnation] = (status, time.monotonic())
            self._components[status.component] = runs
            _forget_oldest(runs, MAX_RUNS)
            _forget_oldest(self._components, MAX_NAMES)
            self._changed.notify_all()

    def take_host(self, status: HostStatus) -> None:
        """Note a host's status."""
        with self._changed:
            self._hosts.pop(status.host, None)
            self._hosts[status.host] = (status, time.monotonic())
            _forget_oldest(self._hosts, MAX_NAMES)
            self._changed.notify_all()

    def take_clock(self, clock: ClockTime) -> None:
        """Note simulated time."""
        with self._changed:
            self._clock = clock
            self._changed.notify_all()

    def take_measured(self, qualities: MeasuredQualities) -> None:
        """Note what a component has measured."""
        with self._changed:
            self._measured.pop(qualities.component, None)
            self._measured[qualities.component] = qualities
            _forget_oldest(self._measured, MAX_NAMES)

    def measured(self, component: str) -> MeasuredQualities | None:
        """Return what a component has measured last, None if nothing was heard."""
        with self._changed:
            return self._measured.get(component)

    def wait_until_heard(self, runs: Mapping[str, int], hosts: set[str], seconds: float) -> None:
        """Wait until all of these runs and hosts have published their status, at most ``seconds``."""

        def heard() -> bool:
            told = all(run in self._components.get(name, {}) for name, run in runs.items())
            return told and hosts <= self._hosts.keys()

        self._wait(heard, seconds)

    def wait_for_host_of(self, component: str, seconds: float) -> None:
        """Wait until a host reports a component's process, at most ``seconds``."""

        def told() -> bool:
            hosts = self._names(set())
            return any(process.component == component for host in hosts for process in self._processes(host))

        self._wait(told, seconds)

    def clock(self, seconds: float) -> ClockTime | None:
        """Return simulated time, waiting at most ``seconds`` for it to be published; None if it is not."""
        self._wait(lambda: self._clock is not None, seconds)
        return self._clock

    def _wait(self, heard: Callable[[], bool], seconds: float) -> None:
        with self._changed:
            self._changed.wait_for(heard, timeout=seconds)

    def components(self, alive: Mapping[str, int]) -> dict[str, ComponentSeen]:
        """Return the components that are alive (name and living run) or that a host has a process for, by name."""
        with self._changed:
            now = time.monotonic()
            processes: dict[str, tuple[str, ProcessStatus]] = {}
            for host in self._names(set()):
                for process in self._processes(host):
                    # While a component is moved, both hosts may report it.
                    if process.component not in processes or process.incarnation == alive.get(process.component):
                        processes[process.component] = (host, process)
            names = sorted(alive | processes.keys())
            return {name: self._component(name, alive.get(name), processes.get(name), now) for name in names}

    def _component(
        self, name: str, run: int | None, process: tuple[str, ProcessStatus] | None, now: float
    ) -> ComponentSeen:
        host, running = process or (None, None)
        speaks = run if run is not None or running is None else running.incarnation
        status, heard = self._components.get(name, {}).get(-1 if speaks is None else speaks, (None, now))
        return ComponentSeen(name, run is not None, status, now - heard if status else None, host, running)

    def hosts(self, alive: set[str]) -> dict[str, HostSeen]:
        """Return the hosts that are alive, were heard of, or that the stack names, by name."""
        with self._changed:
            now = time.monotonic()
            seen = {}
            others = self._others()
            for name in self._names(alive):
                status, heard = self._hosts.get(name, (None, now))
                age = now - heard if status else None
                state = others[name].state if name in others else None
                offer = others[name].offer if name in others else NO_OFFER
                seen[name] = HostSeen(name, name in alive, status, age, state, self._processes(name), offer)
            return seen

    def _names(self, alive: set[str]) -> list[str]:
        return sorted(alive | self._hosts.keys() | self._others().keys())

    def _others(self) -> dict[str, OtherHost]:
        """Return how the first host sees the others; called with the lock held."""
        return {other.host: other for status, _ in self._hosts.values() for other in status.others}

    def _processes(self, host: str) -> tuple[ProcessStatus, ...]:
        """Return the processes that a host reports, or those that are reported of a host that is not there."""
        other = self._others().get(host)
        if other is not None and other.state is not HostState.JOINED:
            return other.processes
        status, _ = self._hosts.get(host, (None, 0.0))
        return status.processes if status else ()


def _forget_oldest(heard: dict[K, V], most: int) -> None:
    while len(heard) > most:
        del heard[next(iter(heard))]
