"""What a client has seen of components and hosts: their latest status, and how long ago that was."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from bus_schema import codec
from bus_schema.errors import BadMessage
from bus_schema.messages.clock import ClockTime
from bus_schema.messages.health import ComponentStatus
from bus_schema.messages.host import HostStatus, ProcessStatus
from regraft.bus import Sample

M = TypeVar("M")


@dataclass(frozen=True, slots=True)
class ComponentSeen:
    """A component as seen from outside.

    ``alive``: one of its runs is on the bus now. ``age``: seconds since its last status, None without one.
    ``host`` and ``process`` are None for a component that no host has told of.
    """

    name: str
    alive: bool
    status: ComponentStatus | None
    age: float | None
    host: str | None
    process: ProcessStatus | None


@dataclass(frozen=True, slots=True)
class HostSeen:
    """A host as seen from outside; ``age`` is the seconds since its last status."""

    name: str
    alive: bool
    status: HostStatus | None
    age: float | None


class Board:
    """The latest status of everybody. Written by the listener's thread, read by any."""

    def __init__(self) -> None:
        """Start empty."""
        self._changed = threading.Condition()
        self._components: dict[str, tuple[ComponentStatus, float]] = {}
        self._hosts: dict[str, tuple[HostStatus, float]] = {}
        self._clock: ClockTime | None = None

    def take_component(self, sample: Sample) -> None:
        """Note a component's status; a run that has been replaced no longer speaks for it."""
        status = _decoded(sample, ComponentStatus)
        if status is None:
            return
        with self._changed:
            known = self._components.get(status.component)
            if known is None or known[0].incarnation <= status.incarnation:
                self._components[status.component] = (status, time.monotonic())
                self._changed.notify_all()

    def take_host(self, sample: Sample) -> None:
        """Note a host's status."""
        status = _decoded(sample, HostStatus)
        if status is None:
            return
        with self._changed:
            self._hosts[status.host] = (status, time.monotonic())
            self._changed.notify_all()

    def take_clock(self, sample: Sample) -> None:
        """Note simulated time."""
        clock = _decoded(sample, ClockTime)
        if clock is None:
            return
        with self._changed:
            self._clock = clock
            self._changed.notify_all()

    def wait_until_heard(self, components: set[str], hosts: set[str], seconds: float) -> None:
        """Wait until all of these have told their status, at most ``seconds``."""
        self._wait(lambda: components <= self._components.keys() and hosts <= self._hosts.keys(), seconds)

    def clock(self, seconds: float) -> ClockTime | None:
        """Return simulated time, waiting at most ``seconds`` for it to be told; None if it is not."""
        self._wait(lambda: self._clock is not None, seconds)
        return self._clock

    def _wait(self, heard: Callable[[], bool], seconds: float) -> None:
        with self._changed:
            self._changed.wait_for(heard, timeout=seconds)

    def components(self, alive: set[str]) -> dict[str, ComponentSeen]:
        """Return the components that are alive or that a host has a process for, by name."""
        with self._changed:
            now = time.monotonic()
            processes = {
                process.component: (host, process)
                for host, (status, _) in self._hosts.items()
                for process in status.processes
            }
            names = sorted(alive | processes.keys())
            return {name: self._component(name, name in alive, processes.get(name), now) for name in names}

    def _component(
        self, name: str, alive: bool, process: tuple[str, ProcessStatus] | None, now: float
    ) -> ComponentSeen:
        status, heard = self._components.get(name, (None, now))
        host, running = process or (None, None)
        return ComponentSeen(name, alive, status, now - heard if status else None, host, running)

    def hosts(self, alive: set[str]) -> dict[str, HostSeen]:
        """Return the hosts that are alive or were heard of, by name."""
        with self._changed:
            now = time.monotonic()
            seen = {}
            for name in sorted(alive | self._hosts.keys()):
                status, heard = self._hosts.get(name, (None, now))
                seen[name] = HostSeen(name, name in alive, status, now - heard if status else None)
            return seen


def _decoded(sample: Sample, cls: type[M]) -> M | None:
    try:
        return codec.decode(sample.payload, cls)
    except BadMessage:
        return None
