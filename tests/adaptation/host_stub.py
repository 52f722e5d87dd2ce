"""Test equipment: answers as a host does, for components that run in this process."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from regraft.bus.memory_bus import MemoryBus, MemoryHub, MemoryQuery
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError
from regraft.bus_schema.messages.protocol.host import (
    DescribeComponent,
    EstimateQualities,
    HostStatus,
    HostView,
    JournalEnd,
    LetSpeak,
    LogLines,
    LogRequest,
    OtherHost,
    ProcessState,
    ProcessStatus,
    StartComponent,
    StartSuccessor,
    StopComponent,
    UpdateSpecs,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.estimation.calling import call
from regraft.host.zygote.estimate_process import estimates
from regraft.stack.describing import Surroundings, describe_component


class HostStub:
    """Keeps specs and the table of processes, and fences as a host does.

    ``refuse`` makes it refuse specs; it does not answer the verbs in ``deaf``. ``launch`` and ``terminate`` are given
    to it by who runs the components; so are ``succeed`` and ``end_run``, for runs beside others. It leaves the next
    ``skips`` questions for its processes unanswered. ``others`` are the hosts that have joined it, or are to.
    """

    def __init__(self, hub: MemoryHub, architecture: Architecture, run: str = "run-1") -> None:
        self.architecture = architecture
        self.run = run
        self.term = 0
        self.journal = JournalEnd()
        self.revision = architecture.revision
        self.specs: dict[str, ComponentSpec] = dict(architecture.components)
        self.processes: dict[str, ProcessStatus] = {}
        self.beside: dict[str, ProcessStatus] = {}
        self.succeed: Callable[[StartSuccessor, int], object] = lambda asked, incarnation: None
        self.end_run: Callable[[str, int], object] = lambda name, started_as: None
        self.speaks: Callable[[str, int], object] = lambda name, started_as: None
        self.updates: list[UpdateSpecs] = []
        self.refuse = ""
        self.refuses_estimates = False
        self.deaf: set[str] = set()
        self.removed: set[str] = set()
        self.last_runs: dict[str, int] = {}
        self.highest: dict[str, int] = {}
        self.launch: Callable[[str, int], object] = lambda name, incarnation: None
        self.terminate: Callable[[str], object] = lambda name: None
        self._lock = threading.Lock()
        self.skips = 0
        self.others: tuple[OtherHost, ...] = ()
        self._bus = MemoryBus(hub)
        keys = Keys(architecture.system)
        self._bus.announce(keys.host("local", "alive"))
        self._bus.serve(keys.host("local", "view"), self._view)
        self._bus.serve(keys.host("local", "specs"), self._specs)
        self._bus.serve(keys.host("local", "journal"), self._keep_end)
        self._bus.serve(keys.host("local", "describe"), self._describe)
        self._bus.serve(keys.host("local", "estimate"), self._estimate)
        self._bus.serve(keys.host("local", "start"), self._start)
        self._bus.serve(keys.host("local", "stop"), self._stop)
        self._bus.serve(keys.host("local", "logs"), self._logs)
        self._bus.serve(keys.host("local", "runs"), self._say_status)
        self._bus.serve(keys.host("local", "succeed"), self._succeed)
        self._bus.serve(keys.host("local", "speak"), self._speak)

    def started(self, component: str, incarnation: int) -> None:
        """Note a process that runs."""
        self.processes[component] = _running(component, incarnation)

    def ended(self, component: str, state: ProcessState = ProcessState.STOPPED) -> None:
        """Note a process that does not run any more."""
        if component in self.processes:
            self.processes[component] = replace(self.processes[component], state=state, pid=0, exit_reason="killed")

    def close(self) -> None:
        """Be gone."""
        self._bus.close()

    def _view(self, query: MemoryQuery) -> None:
        view = HostView(
            "local", self.run, self.term, self.architecture, self._specs_in_force(), self.revision, self.journal
        )
        query.reply(codec.encode(view))

    def _keep_end(self, query: MemoryQuery) -> None:
        end = codec.decode(query.payload, JournalEnd)
        if end.term is not None and end.term >= self.term:
            self.journal = end
        query.reply(query.payload)

    def _specs(self, query: MemoryQuery) -> None:
        update = codec.decode(query.payload, UpdateSpecs)
        if self.skips and not (update.specs or update.removed or update.topics):
            self.skips -= 1
            return
        with self._lock:
            if update.term is None or update.term < self.term:
                problem = f"came with term {update.term}, the current term is {self.term}"
                self._refuse(query, ControlCode.FENCED, problem)
                return
            self.term = update.term
            if (update.specs or update.removed) and self.refuse:
                self._refuse(query, ControlCode.REFUSED, self.refuse)
                return
            if update.specs or update.removed:
                self.updates.append(update)
            self.revision = update.revision
            for spec in update.specs:
                self.specs[spec.name] = spec.described_as(self.specs.get(spec.name))
                self.removed.discard(spec.name)
                never_ran = ProcessStatus(spec.name, self.last_runs.get(spec.name, 0), ProcessState.STOPPED)
                self.processes.setdefault(spec.name, never_ran)
            self.removed |= set(update.removed) & self.specs.keys()
            self.architecture = replace(update.applied_to(self.architecture), revision=self.architecture.revision)
            self._say_status(query)

    def _specs_in_force(self) -> tuple[ComponentSpec, ...]:
        return tuple(spec for name, spec in self.specs.items() if name not in self.removed)

    def _say_status(self, query: MemoryQuery) -> None:
        beside, others = tuple(self.beside.values()), tuple(map(self._placed, self.others))
        query.reply(
            codec.encode(HostStatus("local", 0.0, 1, tuple(self.processes.values()), beside, others, term=self.term))
        )

    def _placed(self, other: OtherHost) -> OtherHost:
        """Return another host with the processes of what the architecture places there, as the first one reports it."""
        components = self.architecture.components
        here = [p for p in other.processes if p.component in components and components[p.component].host == other.host]
        return replace(other, processes=tuple(here))

    def _describe(self, query: MemoryQuery) -> None:
        wanted = codec.decode(query.payload, DescribeComponent)
        query.reply(codec.encode(describe_component(wanted.spec, Surroundings(Path("/stack"), "/run"))))

    def _estimate(self, query: MemoryQuery) -> None:
        if self.refuses_estimates:
            query.reply(codec.encode(ControlError(ControlCode.FAILED, ("not today",))), error=True)
        else:
            query.reply(codec.encode(estimates(codec.decode(query.payload, EstimateQualities), call)))

    def _start(self, query: MemoryQuery) -> None:
        if "start" in self.deaf:
            return
        name = codec.decode(query.payload, StartComponent).component
        with self._lock:
            incarnation = self.processes[name].incarnation + 1
            self.processes[name] = replace(self.processes[name], state=ProcessState.WAITING, incarnation=incarnation)
            self._say_status(query)
        threading.Thread(target=self.launch, args=(name, incarnation), daemon=True).start()

    def _stop(self, query: MemoryQuery) -> None:
        asked = codec.decode(query.payload, StopComponent)
        name = asked.component
        if "stop" in self.deaf:
            return
        if asked.started_as is not None:
            self._say_status(query)
            threading.Thread(target=self._end_run, args=(name, asked.started_as), daemon=True).start()
            return
        with self._lock:
            if name not in self.processes:
                self._refuse(query, ControlCode.MALFORMED, f"there is no component {name!r}")
                return
            self._say_status(query)
        threading.Thread(target=self._end, args=(name,), daemon=True).start()

    def _end(self, name: str) -> None:
        self.terminate(name)
        with self._lock:
            self.ended(name)
            if name in self.removed:
                self.removed.discard(name)
                self.specs.pop(name, None)
                self.last_runs[name] = self.processes.pop(name).incarnation

    def _end_run(self, name: str, started_as: int) -> None:
        self.end_run(name, started_as)
        with self._lock:
            if name in self.beside and self.beside[name].started_as == started_as:
                del self.beside[name]
            elif self.processes[name].started_as == started_as:
                self.ended(name)

    def _succeed(self, query: MemoryQuery) -> None:
        asked = codec.decode(query.payload, StartSuccessor)
        name = asked.spec.name
        with self._lock:
            if name in self.beside or self.processes[name].started_as != asked.incumbent:
                self._refuse(query, ControlCode.MALFORMED, f"{name}: there is no run {asked.incumbent} to succeed")
                return
            self.highest[name] = max(self.highest.get(name, 0), self.processes[name].incarnation) + 1
            self.beside[name] = _running(name, self.highest[name])
            self._say_status(query)
        args = (asked, self.highest[name])
        threading.Thread(target=self.succeed, args=args, daemon=True).start()

    def _speak(self, query: MemoryQuery) -> None:
        asked = codec.decode(query.payload, LetSpeak)
        name = asked.component
        with self._lock:
            if name in self.beside and self.beside[name].started_as == asked.started_as:
                former, self.processes[name] = self.processes[name], self.beside.pop(name)
                if former.pid:
                    self.beside[name] = former
            if asked.above is not None:
                self.highest[name] = max(self.highest[name], asked.above) + 1
                self.processes[name] = replace(self.processes[name], incarnation=self.highest[name])
            self.speaks(name, asked.started_as)
            self._say_status(query)

    def _logs(self, query: MemoryQuery) -> None:
        name = codec.decode(query.payload, LogRequest).component
        query.reply(codec.encode(LogLines(name, (f"the log of {name}",))))

    @staticmethod
    def _refuse(query: Any, code: ControlCode, problem: str) -> None:
        query.reply(codec.encode(ControlError(code, (problem,))), error=True)


def _running(component: str, incarnation: int) -> ProcessStatus:
    return ProcessStatus(component, incarnation, ProcessState.RUNNING, pid=1, started_as=incarnation)
