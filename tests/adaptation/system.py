"""Test equipment: a small system in this process, every component with its real runtime in its own thread."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from regraft.adaptation_manager.manager import AdaptationManager
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.management.manager import CancelAdaptation, JournalPage, JournalRequest, UndoAdaptation
from regraft.bus_schema.messages.protocol.control import ComponentView, ParameterValues
from regraft.bus_schema.messages.protocol.host import StartSuccessor
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Change
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, Constraint, TopicSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.robots.scopes import scope_of
from regraft.client import Client
from regraft.component.component import Component, class_path, describe
from regraft.runtime.core.assignment import Assignment, Succession
from tests.adaptation.host_stub import HostStub
from tests.adaptation.parts import Fragile, Listener, Newcomer, Scanner, Talker
from tests.support.machine.threads import ComponentThread
from tests.support.waiting import PATIENCE

SYSTEM = "t"
M = TypeVar("M")


def in_thread(
    hub: MemoryHub, cls: type[Component], assignment: Assignment, ended: Callable[[], object] = lambda: None
) -> ComponentThread:
    """Run a component in a thread of its own, whose session ends with it."""
    bus = MemoryBus(hub)

    def over() -> None:
        bus.close()
        ended()

    running = ComponentThread(cls, assignment, bus, ended=over)
    running.wait_started()
    return running


@dataclass
class System:
    """A host, components, and as many managers as a test wants."""

    hub: MemoryHub
    architecture: Architecture
    host: HostStub
    journal: Path
    running: dict[str, ComponentThread] = field(default_factory=dict)
    runs: dict[tuple[str, int], ComponentThread] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)
    ends_are_seen: bool = False
    client: Client = field(init=False)

    def __post_init__(self) -> None:
        self.client = Client(MemoryBus(self.hub), SYSTEM, "tester", owns_bus=True)
        self.client.events(self.events.append)
        self.host.launch, self.host.terminate = self.start, self._terminate
        self.host.succeed, self.host.end_run, self.host.speaks = self._succeed, self._end_run, self._speaks

    def start(self, name: str, incarnation: int = 1) -> ComponentThread:
        """Start a component as its spec says."""
        running = self.running[name] = self._run(self.host.specs[name], incarnation, None)
        if running.thread.is_alive():
            self.host.started(name, incarnation)
        return running

    def _succeed(self, asked: StartSuccessor, incarnation: int) -> None:
        self._run(asked.spec, incarnation, Succession(asked.incumbent, asked.with_state))

    def _end_run(self, name: str, started_as: int) -> None:
        Newcomer.release.set()
        run = self.runs[name, started_as]
        if run.thread.is_alive():
            run.runtime.post(run.runtime.handover.end)
            run.thread.join(PATIENCE)

    def _speaks(self, name: str, started_as: int) -> None:
        self.running[name] = self.runs[name, started_as]

    def _run(self, spec: ComponentSpec, incarnation: int, succession: Succession | None) -> ComponentThread:
        name = spec.name
        module, _, cls_name = spec.cls.partition(":")
        cls = getattr(importlib.import_module(module), cls_name)
        assignment = Assignment(
            SYSTEM,
            name,
            spec.cls,
            incarnation,
            dict(spec.parameters),
            dict(spec.connections),
            state=spec.state,
            revision=self.host.revision,
            term=self.host.term,
            simulated=self.architecture.simulated,
            scope=scope_of(name, self.architecture.scopes),
            members=tuple(other for other in {**self.architecture.components, **self.running} if other != name),
            succeeds=succession,
        )
        running = self.runs[name, incarnation] = in_thread(
            self.hub, cls, assignment, lambda: self._has_ended(name, incarnation)
        )
        return running

    def _has_ended(self, name: str, incarnation: int) -> None:
        process = self.host.processes.get(name)
        if process is not None and process.incarnation == incarnation and self.ends_are_seen:
            self.host.ended(name)

    def _terminate(self, name: str) -> None:
        """End a component as its host does: by force if need be."""
        running = self.running.pop(name, None)
        Newcomer.release.set()
        if running is not None and running.thread.is_alive():
            running.end()

    def start_manager(
        self, name: str = "manager", services: dict[str, str] | None = None, **parameters: object
    ) -> ComponentThread:
        """Start an adaptation manager on the journal."""
        values = {
            "journal": str(self.journal),
            "answer_within": 5.0,
            "bind_within": 5.0,
            "undo_within": 5.0,
            **parameters,
        }
        assignment = Assignment(
            SYSTEM,
            name,
            class_path(AdaptationManager),
            parameters=values,
            services=services or {},
            simulated=self.architecture.simulated,
        )
        self.running[name] = in_thread(self.hub, AdaptationManager, assignment)
        return self.running[name]

    def restart(self, name: str) -> ComponentThread:
        """Kill a component and start its next incarnation, as its host would."""
        old = self.running[name]
        old.kill()
        return self.start(name, old.runtime.assignment.incarnation + 1)

    def end(self) -> None:
        """End everything."""
        Fragile.release.set()
        Newcomer.release.set()
        for running in reversed(self.running.values()):
            if running.thread.is_alive():
                running.end()
        for name, started_as in self.runs:
            self._end_run(name, started_as)
        self.client.close()

    # --- asking ---

    def adapt(self, *changes: Change, service: str = "adaptation_manager/adapt", **more: Any) -> AdaptationReport:
        """Ask for an adaptation and wait for its end."""
        return self.client.call(service, AdaptationRequest(changes, **more), AdaptationReport, PATIENCE)

    def undo(self, adaptation: str, **more: Any) -> AdaptationReport:
        """Ask for an adaptation to be undone, or what that would do."""
        request = UndoAdaptation(adaptation, **more)
        return self.client.call("adaptation_manager/undo", request, AdaptationReport, PATIENCE)

    def cancel(self, adaptation: str) -> AdaptationReport:
        """Ask for an adaptation to be cancelled."""
        return self.client.call("adaptation_manager/cancel", CancelAdaptation(adaptation), AdaptationReport, PATIENCE)

    def lines(self, **how: Any) -> JournalPage:
        """Read the journal."""
        return self.client.call("adaptation_manager/journal", JournalRequest(**how), JournalPage, PATIENCE)

    def view(self, name: str) -> ComponentView:
        """Read a component."""
        return self._control(name, "connections", b"")

    def set_parameters(self, name: str, values: dict[str, object]) -> ComponentView:
        """Set parameters of a component past the manager, as one does with the manager's own."""
        return self._control(name, "parameters", codec.encode(ParameterValues(values)))

    def _control(self, name: str, verb: str, payload: bytes) -> ComponentView:
        incarnation = self.running[name].runtime.assignment.incarnation
        key = Keys(SYSTEM).control(name, incarnation, verb)
        (answer,) = self.running[name].bus.query(key, payload, PATIENCE)
        return codec.decode(answer.payload, ComponentView)

    def views(self) -> dict[str, tuple[Any, ...]]:
        """Read all that an adaptation could have touched, of every component but the managers."""
        found = {}
        for name in self.running:
            if name in self.architecture.components:
                view = self.view(name)
                found[name] = (view.incarnation, view.state, view.parameters, view.connections)
        return found


def spec_of(name: str, cls: type[Component], **more: Any) -> ComponentSpec:
    """Return a component's spec with its class's default connections."""
    description = describe(cls)
    connections = {port.name: port.topic for port in description.ports} | more.pop("connections", {})
    return ComponentSpec(name, description.cls, connections=connections, description=description, **more)


def small_architecture(constraints: tuple[Constraint, ...] = ()) -> Architecture:
    """Two talkers with a listener each, a fragile component, and a scanner."""
    specs = [
        spec_of("talker", Talker, connections={"numbers": "numbers"}),
        spec_of("other", Talker, connections={"numbers": "others"}),
        spec_of("listener", Listener, connections={"heard": "numbers", "hint": "hints"}),
        spec_of("second", Listener, connections={"heard": "others", "hint": "hints"}),
        spec_of("fragile", Fragile, connections={"heard": "numbers"}),
        spec_of("scanner", Scanner, connections={"scan": "scan"}, state=State.INACTIVE),
    ]
    twists = {name: TopicSpec(name, "regraft/Twist") for name in ("numbers", "others", "hints", "spare")}
    topics = {**twists, "scan": TopicSpec("scan", "regraft/LaserScan")}
    return Architecture(SYSTEM, 1, False, {spec.name: spec for spec in specs}, topics, constraints=constraints)


@contextmanager
def started(architecture: Architecture, folder: Path) -> Iterator[System]:
    """Run all components of an architecture, without a manager; its journal will be in ``folder``."""
    Fragile.release.clear()
    hub = MemoryHub()
    system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    for name in architecture.components:
        system.start(name)
    try:
        yield system
    finally:
        system.end()
