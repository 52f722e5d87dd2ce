"""The topics ``system/...`` under the real clock: the first host publishes them where somebody reads."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from regraft.bus.interface import Bus, BusError, Closable, Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_named
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus, Diagnostic, Event
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.management.system import ComponentState, SystemFault, SystemFaultKind
from regraft.bus_schema.messages.protocol.host import HostStatus
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.system_topics import (
    DIAGNOSTICS,
    FAULTS,
    HOSTS,
    MEASUREMENTS,
    QUALITIES,
    STATES,
    SYSTEM_TOPICS,
)
from regraft.runtime.core.clock import Clock
from regraft.runtime.data.system_view import ENDS, SystemView
from regraft.runtime.data.writers import Identity, Writers

RESTARTED = "component.restarted"
"""An end, with the incarnation of the run that follows."""
KINDS = {
    "component.failed": SystemFaultKind.FAILED,
    "component.fault": SystemFaultKind.RAISED,
    "component.recovered": SystemFaultKind.RECOVERED,
    RESTARTED: SystemFaultKind.DIED,
    "component.ended": SystemFaultKind.DIED,
    "component.quarantined": SystemFaultKind.QUARANTINED,
}
"""The faults that events speak of, by the kind of the event."""
GONE = {HostState.LOST: "is lost", HostState.LEFT: "has left"}
"""The states of a host after which nothing runs there."""
HOST_GONE, HOST_BACK = "host_gone", "host_back"
"""The codes of a run that ends because its host is gone, and of one that had not ended."""
HUNG = "component.hung"
REMOVED = "component.removed"


class HostSystemTopics:
    """The writer of the topics ``system/...`` under the real clock. Where nobody reads, it listens to nothing."""

    def __init__(
        self,
        bus: Bus,
        keys: Keys,
        host: str,
        clock: Clock,
        post: Callable[[Callable[[], None]], object],
        reported_run: Callable[[str], int | None],
    ) -> None:
        """Listen to nothing yet.

        ``post`` has something called on the host's thread soon. ``reported_run`` returns the run of a component as its
        host reports it, None if it reports none.
        """
        self._bus = bus
        self._host = host
        self._post = post
        self._reported_run = reported_run
        self._keys = keys
        self._clock = clock
        self._writers = Writers(bus, clock, Identity(f"system-{host}", 1, 1))
        self._view = SystemView()
        self._readers: dict[str, set[str]] = {}
        self._known: Architecture | None = None
        self._declared: dict[str, Closable] = {}
        self._hung: set[str] = set()
        self._gone: set[str] = set()
        self._log = logging.getLogger("host")

    def see(self, architecture: Architecture) -> None:
        """Take which components read which topics; begin to listen when the first does."""
        if architecture is self._known:
            return
        self._known = architecture
        before, self._readers = self._readers, _readers(architecture)
        for name, topics in self._readers.items():
            self._view.changed |= topics - before.get(name, set())
        read = set[str]().union(*self._readers.values())
        for key, (topics, take) in self._sources().items():
            if read & topics and key not in self._declared:
                self._declared[key] = self._bus.subscribe(key, self._sink(take))

    def _sources(self) -> dict[str, tuple[set[str], Callable[[Sample], None]]]:
        """Return the topics for which a key is listened to, and what takes its samples."""
        keys, view = self._keys, self._view
        return {
            keys.status("*"): ({*SYSTEM_TOPICS}, self._take_status),
            keys.event: ({FAULTS, STATES, MEASUREMENTS}, self._take_event),
            keys.diagnostics: ({DIAGNOSTICS}, lambda s: view.take_diagnostic(codec.decode(s.payload, Diagnostic))),
            keys.quality("**"): ({QUALITIES}, lambda s: view.take_quality(codec.decode(s.payload, Quality))),
            keys.qualities("*"): ({MEASUREMENTS}, self._take_measured),
            keys.host(self._host, "status"): ({HOSTS, FAULTS, STATES, MEASUREMENTS}, self._take_hosts),
        }

    def publish(self) -> None:
        """Publish what is new on the topics that are read, in the order of their names."""
        if not self._view.changed:
            return
        read = set().union(*self._readers.values())
        for topic in sorted(self._view.changed):
            if topic not in read:
                self._view.pass_over(topic)
                continue
            encoding = type_named(SYSTEM_TOPICS[topic]).encoding
            try:
                writer = self._writers.open(self._keys.topic(topic), encoding)
                writer.put(codec.encode(self._view.message(topic, self._now)))
            except (BusError, SchemaError) as error:
                self._log.warning("%s: %s", topic, error)

    def close(self) -> None:
        """Stop listening and publishing."""
        for closable in self._declared.values():
            closable.close()
        self._writers.close_all()

    @property
    def _now(self) -> float:
        return self._clock.now() / 1e9

    def _sink(self, take: Callable[[Sample], None]) -> Callable[[Any], object]:
        """Have what comes be taken on the host's thread, which looks often enough by itself."""

        def take_item(item: Any) -> None:
            sample = self._bus.open_sample(item)
            if sample is not None:
                try:
                    take(sample)
                except SchemaError as error:
                    self._log.warning("%s: %s", sample.key, error)

        return lambda item: self._post(lambda: take_item(item))

    # --- what is heard ---

    def _take_status(self, sample: Sample) -> None:
        status = codec.decode(sample.payload, ComponentStatus)
        name = status.component
        before, fault = self._view.states.get(name), self._view.faults.get(name)
        is_lower = before is not None and status.incarnation < before.incarnation
        if not self._has(name) or (is_lower and status.incarnation != self._reported_run(name)):
            return
        as_gone = fault is not None and (fault.code, fault.incarnation) == (HOST_GONE, status.incarnation)
        if as_gone and self._is_gone(name):
            return  # it is heard a little before its host has joined again
        self._view.take_state(ComponentState(name, status.incarnation, status.state, status.failure), self._now)
        if fault is not None and (as_gone or is_lower) and not status.failure:
            # A lower run than the present one shows that this was forged: it has no fault.
            code, recovered = HOST_BACK if as_gone else "another_run", SystemFaultKind.RECOVERED
            text = f"{name} is heard of again"
            self._view.take_fault(SystemFault(self._now, name, status.incarnation, recovered, text, code))
        as_before = before is not None and (before.incarnation, before.state) == (status.incarnation, State.ACTIVE)
        if status.state is State.ACTIVE and not as_before:
            self._view.changed |= self._readers.get(name, set())  # it reads from now on

    def _take_event(self, sample: Sample) -> None:
        """Take an event; raises SchemaError where its details make no fault."""
        event = codec.decode(sample.payload, Event)
        name = event.subject
        if not self._has(name) and event.kind != REMOVED:
            return
        if event.kind == HUNG:
            self._hung.add(name)
        elif event.kind == REMOVED:
            self._view.remove(name)
        elif event.kind in KINDS:
            kind = KINDS[event.kind]
            if kind is SystemFaultKind.DIED and name in self._hung:
                kind = SystemFaultKind.HUNG
            if kind in ENDS:
                self._hung.discard(name)
            known = self._view.states.get(name)
            code = str(event.details.get("code", ""))
            incarnation = _incarnation(event, known)
            fault = SystemFault(event.stamp, name, incarnation, kind, event.text, code)
            codec.encode(fault)  # raises BadMessage: the details of an event may be anything
            self._view.take_fault(fault)
            if known is not None and kind in ENDS and known.incarnation > incarnation:
                self._view.take_state(known, self._now)  # its next run is here already

    def _take_measured(self, sample: Sample) -> None:
        """Take a measurement by this host's clock: readers compare no clocks of two components."""
        measured = codec.decode(sample.payload, MeasuredQualities)
        if self._has(measured.component):
            self._view.take_measured(replace(measured, stamp=self._now))

    def _take_hosts(self, sample: Sample) -> None:
        others = codec.decode(sample.payload, HostStatus).others
        self._view.take_hosts(others)
        self._gone = {other.host for other in others if other.state in GONE}
        for other in others:
            if other.state in GONE:
                self._take_gone(other.host, GONE[other.state])

    def _has(self, component: str) -> bool:
        """Return whether the architecture has a component: anybody may name others."""
        return self._known is not None and component in self._known.components

    def _is_gone(self, component: str) -> bool:
        """Return whether the host of a component is gone."""
        spec = self._known.components.get(component) if self._known else None
        return spec is not None and spec.host in self._gone

    def _take_gone(self, host: str, how: str) -> None:
        """Take the ends of what ran on a host that is gone: the host itself can report none."""
        components = self._known.components if self._known else {}
        for name, known in list(self._view.states.items()):
            if name in components and components[name].host == host and known.state is not None:
                text = f"host {host!r} {how}"
                died = SystemFaultKind.DIED
                self._view.take_fault(SystemFault(self._now, name, known.incarnation, died, text, HOST_GONE))


def _incarnation(event: Event, known: ComponentState | None) -> int:
    """Return the run that an event is about: its own, or the last one that is known."""
    next_run = event.details.get("incarnation")
    if event.kind == RESTARTED and isinstance(next_run, int):
        return next_run - 1
    return known.incarnation if known else 0


def _readers(architecture: Architecture) -> dict[str, set[str]]:
    """Return the components that read what the system publishes of itself, and which topics of it."""
    read = {name: SYSTEM_TOPICS.keys() & spec.connections.values() for name, spec in architecture.components.items()}
    return {name: topics for name, topics in read.items() if topics}
