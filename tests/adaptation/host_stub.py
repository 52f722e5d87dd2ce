"""Test equipment: answers as a host does, for components that run in this process."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any

from bus_schema import codec
from bus_schema.architecture import Architecture, ComponentSpec
from bus_schema.keys import Keys
from bus_schema.messages.control import ControlCode, ControlError
from bus_schema.messages.host import HostStatus, HostView, ProcessState, ProcessStatus, UpdateSpecs
from regraft.memory_bus import MemoryBus, MemoryHub, MemoryQuery


class HostStub:
    """Keeps specs and the table of processes, and fences as a host does; ``refuse`` makes it refuse specs."""

    def __init__(self, hub: MemoryHub, architecture: Architecture, run: str = "run-1") -> None:
        self.architecture = architecture
        self.run = run
        self.term = 0
        self.revision = architecture.revision
        self.specs: dict[str, ComponentSpec] = dict(architecture.components)
        self.processes: dict[str, ProcessStatus] = {}
        self.updates: list[UpdateSpecs] = []
        self.refuse = ""
        self._lock = threading.Lock()
        self._bus = MemoryBus(hub)
        keys = Keys(architecture.system)
        self._bus.announce(keys.host("local", "alive"))
        self._bus.serve(keys.host("local", "view"), self._view)
        self._bus.serve(keys.host("local", "specs"), self._specs)

    def started(self, component: str, incarnation: int) -> None:
        """Note a process that runs."""
        self.processes[component] = ProcessStatus(component, incarnation, ProcessState.RUNNING, pid=1)

    def ended(self, component: str, state: ProcessState = ProcessState.STOPPED) -> None:
        """Note a process that does not run any more."""
        self.processes[component] = replace(self.processes[component], state=state, pid=0, last_end="killed")

    def close(self) -> None:
        """Be gone."""
        self._bus.close()

    def _view(self, query: MemoryQuery) -> None:
        view = HostView("local", self.run, self.term, self.architecture, tuple(self.specs.values()))
        query.reply(codec.encode(view))

    def _specs(self, query: MemoryQuery) -> None:
        update = codec.decode(query.payload, UpdateSpecs)
        with self._lock:
            if update.term is None or update.term < self.term:
                problem = f"came with term {update.term}, the current term is {self.term}"
                self._refuse(query, ControlCode.FENCED, problem)
                return
            self.term = update.term
            if update.specs and self.refuse:
                self._refuse(query, ControlCode.REFUSED, self.refuse)
                return
            if update.specs:
                self.updates.append(update)
                self.revision = update.revision
            self.specs |= {spec.name: spec.described_as(self.specs.get(spec.name)) for spec in update.specs}
            query.reply(codec.encode(HostStatus("local", 0.0, 1, tuple(self.processes.values()))))

    @staticmethod
    def _refuse(query: Any, code: ControlCode, problem: str) -> None:
        query.reply(codec.encode(ControlError(code, (problem,))), error=True)
