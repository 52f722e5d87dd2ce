"""The view that ``up`` has of its system: statuses, simulated time, the mission, the battery, events."""

from __future__ import annotations

import queue
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

from regraft.bus.interface import Bus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus, Event
from regraft.bus_schema.messages.mission import MissionStatus
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.system.launch import Running

M = TypeVar("M")

MAX_EVENTS = 10_000
"""Events that may wait to be shown; further ones are dropped."""


class Newest:
    """The newest message at a key, opened only when it is looked at: most never are."""

    def __init__(self, bus: Bus, key: str) -> None:
        """Listen to ``key``."""
        self._bus = bus
        self._item: Any = None
        bus.subscribe(key, self._take)

    def _take(self, item: Any) -> None:
        self._item = item

    def look(self, cls: type[M]) -> M | None:
        """Return the newest message, None before the first and for one that does not fit."""
        sample = self._bus.open_sample(self._item) if self._item is not None else None
        if sample is None:
            return None
        try:
            return codec.decode(sample.payload, cls)
        except BadMessage:
            return None


@dataclass(frozen=True, slots=True)
class StartupWait:
    """Why a component is not as the stack wants it: its process, its lifecycle state once it has one, its error.

    ``begun`` is false until its process is started for the first time.
    """

    process: ProcessState
    begun: bool
    state: State | None = None
    error: str = ""

    def __str__(self) -> str:
        """Return it in words, such as ``inactive: no such file``."""
        shown = self.process.value if self.process is not ProcessState.RUNNING else "starting"
        if self.state is not None:
            shown = self.state.value
        return f"{shown}: {self.error}" if self.error else shown


@dataclass(frozen=True, slots=True)
class Readiness:
    """How many components are as the stack wants them, and why the others are not."""

    ready: int
    total: int
    waiting: dict[str, StartupWait]

    @property
    def complete(self) -> bool:
        """Whether all are."""
        return self.ready == self.total

    def reasons(self) -> str:
        """Return in words why components are not as wanted; those that are still to be started come last."""
        begun = [f"{name} ({waiting})" for name, waiting in sorted(self.waiting.items()) if waiting.begun]
        not_begun = sorted(name for name, waiting in self.waiting.items() if not waiting.begun)
        return "; ".join([*begun, *([f"not started yet: {', '.join(not_begun)}"] if not_begun else [])])


class Watch:
    """Looks on from the host's process. Everything but a queue's ``put`` happens on the caller's thread."""

    def __init__(self, running: Running) -> None:
        self._running = running
        self._bus = running.bus
        self._inbox: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.statuses: dict[str, ComponentStatus] = {}
        self._elsewhere: dict[str, ProcessStatus] = {}
        keys = Keys(running.info.system)
        self._bus.subscribe(keys.status("*"), self._inbox.put)
        self._bus.subscribe(keys.event, self._inbox.put)
        self._clock = Newest(self._bus, keys.clock("time"))
        self._missions = self._newest(keys, MissionStatus)
        self._batteries = self._newest(keys, BatteryState)
        self._time: ClockTime | None = None

    def _newest(self, keys: Keys, cls: type) -> dict[str, Newest]:
        """Listen to all topics of a type, by the robots that they are of."""
        topics = self._running.host.plan.architecture.topics.values()
        names = [topic.name for topic in topics if topic.type == type_of(cls).name]
        first = {name.rpartition("/")[0]: name for name in reversed(names)}
        return {robot: Newest(self._bus, keys.topic(name)) for robot, name in sorted(first.items())}

    def take(self) -> list[Event]:
        """Take what has come; returns the events among it."""
        events: list[Event] = []
        for _ in range(min(self._inbox.qsize(), MAX_EVENTS)):
            sample = self._bus.open_sample(self._inbox.get_nowait())
            if sample is None:
                continue
            try:
                if sample.key.endswith("/event"):
                    events.append(codec.decode(sample.payload, Event))
                else:
                    self._take_status(codec.decode(sample.payload, ComponentStatus))
            except BadMessage:
                continue
        return events

    def _take_status(self, status: ComponentStatus) -> None:
        run = self._running.host.processes.get(status.component) or self._elsewhere.get(status.component)
        if run is not None and status.incarnation == run.incarnation:
            self.statuses[status.component] = status

    # --- what is seen ---

    def clock(self) -> ClockTime | None:
        """Return simulated time as last published."""
        self._time = self._clock.look(ClockTime) or self._time
        return self._time

    def missions(self) -> dict[str, MissionStatus]:
        """Return the missions as last published, by robot."""
        return _looked_at(self._missions, MissionStatus)

    def batteries(self) -> dict[str, BatteryState]:
        """Return the batteries as last published, by robot."""
        return _looked_at(self._batteries, BatteryState)

    def processes(self) -> tuple[ProcessStatus, ...]:
        """Return the processes that the hosts have."""
        host = self._running.host
        elsewhere = host.others.processes()
        self._elsewhere = {process.component: process for process in elsewhere}
        return (
            *host.status().processes,
            *(process for process in elsewhere if process.component not in host.processes),
        )

    def readiness(self) -> Readiness:
        """Report how far the system is on its way to the state that the stack wants."""
        specs = self._running.host.plan.architecture.components
        waiting = {}
        for process in self.processes():
            spec = specs.get(process.component)
            why = self._waits_for(spec, process) if spec else None
            if why is not None:
                waiting[process.component] = why
        return Readiness(len(specs) - len(waiting), len(specs), waiting)

    def _waits_for(self, spec: ComponentSpec, process: ProcessStatus) -> StartupWait | None:
        if process.state is ProcessState.STOPPED and process.incarnation and not spec.managed:
            return None
        begun = process.incarnation > 0
        status = self.statuses.get(spec.name)
        speaks = process.state is ProcessState.STARTING and status is not None
        if process.state is not ProcessState.RUNNING and not speaks:
            return StartupWait(process.state, begun, error=process.exit_reason)
        if not spec.managed or (status and status.incarnation == process.incarnation and status.state is spec.state):
            return None
        if status is None:
            return StartupWait(process.state, begun)
        return StartupWait(process.state, begun, status.state, status.error)

    def quarantined(self) -> list[str]:
        """Return the components that were restarted too often."""
        return [p.component for p in self.processes() if p.state is ProcessState.QUARANTINED]

    def given_up(self) -> set[str]:
        """Return the components that do not come up by themselves: quarantined, or failed in configuring."""
        specs = self._running.host.plan.architecture.components
        failed = {
            name
            for name, status in self.statuses.items()
            if status.state is State.UNCONFIGURED and status.failure and name in specs
            if specs[name].state is not State.UNCONFIGURED
        }
        return failed.union(self.quarantined())

    def url(self) -> str | None:
        """Return where the gateway is."""
        return next(self._told("url"), None)

    def renderer(self) -> str | None:
        """Return what draws the cameras' pictures; several are joined by ``+``."""
        return "+".join(sorted(set(self._told("renderer")))) or None

    def _told(self, name: str) -> Iterator[str]:
        values = (status.values.get(name) for status in self.statuses.values())
        return (value for value in values if isinstance(value, str))


def _looked_at(newest: dict[str, Newest], cls: type[M]) -> dict[str, M]:
    found = {robot: each.look(cls) for robot, each in newest.items()}
    return {robot: message for robot, message in found.items() if message is not None}
