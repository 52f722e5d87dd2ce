"""Carries out the faults on a run's schedule, at the components of one host."""

from __future__ import annotations

import signal
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from regraft.bus.interface import Answer, Bus, BusError, Query
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.faults import BringBack, FaultInjected, InjectFault
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.scheduled_faults import FaultKind, ScheduledFault
from regraft.host.host_publisher import UnknownComponent
from regraft.host.runs.managed_process import ManagedProcess
from regraft.host.supervisor import Supervisor

INJECT = "inject"
READY_TIMEOUT = 2.0
"""Seconds in which a component answers before its fault: by then, all that it has put has arrived."""
MAX_TRIES = 5
"""Times that a component is asked: on a busy machine a question, or its answer, may be late or lost."""
SIGNALS = {FaultKind.KILL: signal.SIGKILL, FaultKind.STOP: signal.SIGSTOP}

Done = Callable[[FaultInjected], object]


@dataclass(slots=True)
class _Injection:
    """A fault that has begun: who waits for what has become of it, and that, once it is known."""

    waiting: list[Done]
    run: str = ""
    result: FaultInjected | None = None


class FaultInjector:
    """The faults of one host's components. Everything happens on the host's thread; ``post`` calls something there."""

    def __init__(self, host: Supervisor, bus: Bus, keys: Keys, post: Callable[[Callable[[], None]], object]) -> None:
        self._host = host
        self._bus = bus
        self._keys = keys
        self._post = post
        self._begun: dict[ScheduledFault, _Injection] = {}
        self._due: deque[ScheduledFault] = deque()
        self._started = 0.0

    def ask(self, query: Query) -> None:
        """Begin to answer a query; raises BadMessage."""
        wanted = codec.decode(query.payload, InjectFault)
        if wanted.fault not in self._host.plan.faults:
            raise BadMessage(f"fault: '{wanted.fault}' is not on the schedule of this run")
        self.inject(wanted, lambda injected: query.reply(codec.encode(injected)))

    def inject(self, wanted: InjectFault, done: Done) -> None:
        """Have a component fail; ``done`` is called when its run has ended, or at once if it continues.

        Each fault happens once, also if it is asked for again because the answer was lost.
        """
        begun = self._begun.get(wanted.fault)
        if begun is not None:
            if begun.result is None:
                begun.waiting.append(done)
            else:
                done(begun.result)
            return
        self._begun[wanted.fault] = _Injection([done])
        name = wanted.fault.component
        managed = self._host.processes.get(name)
        if managed is None or not managed.pid:
            why = "is not on this host" if managed is None else "has no process"
            missed = FaultInjected(name, managed.incarnation if managed else 0, missed=f"{name} {why}")
            self._finish(wanted.fault, missed)
            return

        self._ask_component(wanted, managed, MAX_TRIES)

    def _ask_component(self, wanted: InjectFault, managed: ManagedProcess, tries: int) -> None:
        def ready(answers: list[Answer]) -> None:
            if answers or tries <= 1 or not managed.pid:
                self._post(lambda: self._begin(wanted, managed, answers))
            else:
                self._post(lambda: self._ask_component(wanted, managed, tries - 1))

        key = self._keys.control(managed.spec.name, managed.incarnation, "fault")
        try:
            self._bus.ask(key, codec.encode(wanted.fault), READY_TIMEOUT, ready)
        except BusError:
            ready([])

    def _begin(self, wanted: InjectFault, managed: ManagedProcess, answers: list[Answer]) -> None:
        fault, run = wanted.fault, managed.incarnation
        refused = not answers or answers[0].error
        if not managed.pid or (refused and fault.kind not in SIGNALS):
            why = "takes no such fault" if answers else "has not answered"
            self._finish(
                fault, FaultInjected(fault.component, run, certain=bool(answers), missed=f"{fault.component} {why}")
            )
            return
        self._host.report_fault(fault)
        if not fault.kind.ends_the_run:
            self._finish(fault, FaultInjected(fault.component, run))
            return
        managed.held_until = fault.until if wanted.held else None
        self._begun[fault].run = managed.run
        if fault.kind in SIGNALS:
            self._host.signal(managed, SIGNALS[fault.kind])

    def _finish(self, fault: ScheduledFault, result: FaultInjected) -> None:
        injection = self._begun[fault]
        injection.run, injection.result = "", result
        waiting, injection.waiting = injection.waiting, []
        for done in waiting:
            done(result)

    def ended(self, managed: ManagedProcess) -> None:
        """Note that a run has ended, and how."""
        fault = next((fault for fault, injection in self._begun.items() if injection.run == managed.run), None)
        if fault is not None:
            stopped = managed.state is ProcessState.QUARANTINED
            name, run = managed.spec.name, managed.incarnation
            self._finish(fault, FaultInjected(name, run, managed.exit_reason, managed.is_held, stopped))

    def bring_back(self, payload: bytes) -> FaultInjected:
        """Restart a component that is held back; raises BadMessage, UnknownComponent."""
        name = codec.decode(payload, BringBack).component
        managed = self._host.processes.get(name)
        if managed is None or managed.removed:
            raise UnknownComponent(f"there is no component {name!r} on host {self._host.plan.name!r}")
        managed.release(time.monotonic())
        return FaultInjected(name, managed.incarnation, comes_back=managed.has_process or managed.start_at is not None)

    # --- under the real clock ---

    def start(self, now: float) -> None:
        """Count the time of the schedule from ``now``, in monotonic seconds."""
        self._due = deque(sorted(self._host.plan.faults, key=lambda fault: fault.at))
        self._started = now

    def look(self, now: float) -> None:
        """Begin with what is due."""
        while self._due and self._due[0].at <= now - self._started:
            self.inject(InjectFault(self._due.popleft()), self._report_missed)

    def _report_missed(self, injected: FaultInjected) -> None:
        if injected.missed:
            self._host.report_missed(injected.component, injected.missed)
