"""Supervises the components of one host: starts, restarts, watches and ends their processes."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from regraft.bus_schema.messages.protocol.host import (
    HostStatus,
    JournalEnd,
    OtherHost,
    ProcessState,
    ProcessStatus,
    UpdateSpecs,
)
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.scheduled_faults import ScheduledFault
from regraft.host.host_publisher import HostPublisher
from regraft.host.plan import HostPlan
from regraft.host.runs.managed_process import ManagedProcess
from regraft.host.runs.restart_backoff import RestartHistory
from regraft.host.runs.run_history import RunHistory
from regraft.host.runs.standby_runs import ALONE_TIMEOUT, StandbyRuns
from regraft.host.runs.trials import Trials
from regraft.host.watchdog.process_killer import ProcessKiller
from regraft.host.zygote.zygote import Zygote
from regraft.process.logs import log_of
from regraft.process.main import EXIT_FAULT, how_it_ended
from regraft.runtime.core.clock import RealClock

ZYGOTE_GONE = "the process that starts the others is gone"
FIRST_BEAT_TIMEOUT = 15.0
MAX_STARTING = 32
"""Processes that start at a time: more would only wait for a processor, and keep it from this host."""


class Supervisor:
    """Starts, watches, restarts and ends the components of one host.

    Attributes:
        ended: whether the zygote is gone, and every process with it.
        when_ended: called with a component whose process has ended.
    """

    def __init__(self, plan: HostPlan, zygote: Zygote, publisher: HostPublisher) -> None:
        self.plan = plan
        self.term = 0
        self.journal = JournalEnd()
        self.revision = plan.architecture.revision
        self.processes = {
            name: ManagedProcess(spec, RestartHistory(spec.restart)) for name, spec in plan.mine().items()
        }
        self.past = RunHistory()
        self.standby_runs = StandbyRuns(self.processes, self.past)
        self._trials = Trials()
        self.ended = False
        self._zygote = zygote
        self._clock = RealClock()
        self._publisher = publisher
        self._killer = ProcessKiller(publisher, zygote)
        self._next_status = 0.0
        self.when_ended: Callable[[ManagedProcess], object] = lambda _: None

    @property
    def log_folder(self) -> Path:
        return self.plan.folder / "logs"

    def all_processes(self) -> list[ManagedProcess]:
        return [*self.processes.values(), *self.standby_runs.processes.values()]

    def room(self) -> int:
        return max(0, MAX_STARTING - sum(managed.is_starting for managed in self.all_processes()))

    def start_due(self) -> None:
        now, room = time.monotonic(), self.room()
        for managed in self.all_processes():
            self.standby_runs.restart_if_alone(managed, now)
            if managed.start_at is not None and managed.start_at <= now and room:
                managed.start_at, room = None, room - 1
                self.spawn(managed)
            if managed.kill_at is not None and managed.kill_at <= now and managed.pid:
                managed.kill_at = None
                self._zygote.signal(managed.pid, signal.SIGKILL)

    def spawn(self, managed: ManagedProcess) -> None:
        """Start a process."""
        managed.incarnation = managed.started_as = self.standby_runs.next_number(managed)
        managed.formerly = ()
        managed.state, managed.seen, managed.stopping, managed.why_killed = ProcessState.STARTING, False, False, ""
        managed.started = self._clock.now() / 1e9
        log = str(log_of(self.log_folder, managed.spec.name))
        managed.awaited = managed.is_held = False
        try:
            lease = self.lease_of(managed)
        except OSError as error:  # no more files may be open: it is tried again as any that cannot be started
            managed.why_killed = f"there can be no lease of it: {error.strerror}"
            self._process_ended(managed, EXIT_FAULT)
            return
        order = managed.order(self.plan, self.revision, self.term) | {"lease": lease}
        managed.restart_by = None
        managed.succeeds = None  # a restarted run succeeds no living one
        command, files = list(managed.spec.command) or None, self.plan.limits(managed.spec).files
        try:
            self._zygote.spawn(order, str(self.plan.stack_folder), log, command, files)
        except OSError:
            self.zygote_gone()
            return
        managed.ordered = True

    def lease_of(self, managed: ManagedProcess) -> str:
        """Return the path of the lease by which a process may act, empty if it always may; raises OSError."""
        return ""

    def zygote_gone(self) -> None:
        """Everything it had started has ended with it."""
        if not self.ended:
            self._publisher.event("host.fault", self.plan.name, f"{ZYGOTE_GONE}: the system ends")
        self.ended = True
        for managed in self.all_processes():
            managed.ordered, managed.pid, managed.start_at, managed.kill_at = False, 0, None, None
            self._killer.forget(managed)

    def zygote_reports(self, report: dict[str, Any]) -> None:
        managed = self.standby_runs.run_of(report["name"], report["incarnation"])
        if managed is None:
            return
        managed.ordered = False
        if "aborted" in report:
            self._killer.aborted(managed, time.monotonic())
        elif "started" in report:
            managed.pid = report["started"]
            if managed.stopping:
                self._zygote.signal(managed.pid, signal.SIGTERM)
            elif managed.spec.managed:
                timeout = self.plan.architecture.handler_timeout(managed.spec)
                self._killer.expect(managed, FIRST_BEAT_TIMEOUT + timeout, time.monotonic())
            else:
                managed.state = ProcessState.RUNNING
        else:
            self._process_ended(managed, report["code"])
            self.when_ended(managed)
            managed.held_until = None
            if managed.spec.name == self.plan.source:
                self._release_all()  # nobody would ask for them
        self._next_status = 0.0

    def _process_ended(self, managed: ManagedProcess, code: int) -> None:
        name, scheduled = managed.spec.name, managed.held_until is not None
        self._killer.forget(managed)
        managed.pid, managed.kill_at = 0, None
        managed.exit_reason = managed.why_killed or how_it_ended(code)
        if self.standby_runs.stands(managed):
            managed.state = ProcessState.STOPPED
            if managed.stopping:
                self.standby_runs.forget(managed)
            return
        if managed.removed:
            # Asked to end, it is forgotten; ended by itself, it stays until it is asked to.
            managed.state, managed.owed = ProcessState.STOPPED, managed.history.wants_restart(code)
            if managed.stopping:
                self._forget(managed)
            return
        if managed.stopping:
            managed.state = ProcessState.STOPPED
            managed.start_at = time.monotonic() if managed.start_again else None
            return
        if self._is_elsewhere(name):
            managed.state = ProcessState.STOPPED
            return
        if not managed.history.wants_restart(code):
            managed.state = ProcessState.STOPPED
            self._publisher.event("component.ended", name, f"{name} ended: {managed.exit_reason}", scheduled=scheduled)
            return
        if self.standby_runs.awaits(managed):
            managed.state, managed.restart_by = ProcessState.STOPPED, time.monotonic() + ALONE_TIMEOUT
            text = f"{name} ended: {managed.exit_reason}; another run of it waits to continue"
            self._publisher.event("component.ended", name, text, scheduled=scheduled)
            return
        if not self._may_start_again(managed):
            managed.state = ProcessState.QUARANTINED
            limit = f"{managed.spec.restart.limit} restarts in {managed.spec.restart.window:g} s"
            text = f"{name} ended: {managed.exit_reason}; it had {limit} and is left stopped until someone acts"
            self._publisher.event(
                "component.quarantined", name, text, incarnation=managed.incarnation, scheduled=scheduled
            )
            return
        managed.state = ProcessState.WAITING
        when = f" at {managed.held_until:g} s of simulated time" if managed.held_until is not None else ""
        text = f"{name} ended: {managed.exit_reason}; it is restarted{when} as incarnation {managed.incarnation + 1}"
        following, ended = managed.incarnation + 1, managed.exit_reason
        self._publisher.event(
            "component.restarted", name, text, incarnation=following, ended=ended, scheduled=scheduled
        )

    @staticmethod
    def _may_start_again(managed: ManagedProcess) -> bool:
        """Set when a component is to start again, at once or when it is brought back; return whether it may."""
        if managed.held_until is not None:
            managed.is_held = managed.history.allows_at(managed.held_until)
            return managed.is_held
        managed.start_at = managed.history.next_start(time.monotonic())
        return managed.start_at is not None

    def _is_elsewhere(self, name: str) -> bool:
        """Return whether a component is placed on another host by now."""
        spec = self.plan.architecture.components.get(name)
        return spec is not None and spec.host != self.plan.name

    def _forget(self, managed: ManagedProcess) -> None:
        del self.processes[managed.spec.name]
        self.past.note(managed.spec.name, managed.past_until, managed.checkpoint)
        self._killer.forget(managed)
        self._next_status = 0.0
        if not self._is_elsewhere(managed.spec.name):
            self._publisher.event("component.removed", managed.spec.name, f"{managed.spec.name} was removed")

    def ask_to_end(self, managed: ManagedProcess, grace: float) -> None:
        """End a process, by force after ``grace`` seconds, and do not restart it."""
        managed.stopping, managed.start_again, managed.start_at, managed.restart_by = True, False, None, None
        if not managed.has_process:
            managed.state = ProcessState.STOPPED
            if self.standby_runs.stands(managed):
                self.standby_runs.forget(managed)
            elif managed.removed:
                self._forget(managed)
            return
        self._killer.forget(managed)
        managed.kill_at = time.monotonic() + grace
        if managed.pid:
            self._zygote.signal(managed.pid, signal.SIGTERM)
            self._zygote.signal(managed.pid, signal.SIGCONT)

    def beats(self, managed: ManagedProcess) -> None:
        now = time.monotonic()
        if managed.seen:
            self._killer.beat(managed, now)
            return
        managed.seen, managed.state = True, ProcessState.RUNNING
        self._next_status = 0.0
        if managed.stopping:
            return
        self._killer.expect(managed, self.plan.architecture.handler_timeout(managed.spec), now)
        if managed.spec.name == self.plan.source:
            self._start_the_others(now)

    def _release_all(self) -> None:
        for managed in self.processes.values():
            managed.release(time.monotonic())

    def signal(self, managed: ManagedProcess, number: signal.Signals) -> None:
        """Send a signal to a component's process."""
        self._zygote.signal(managed.pid, number)

    def report_fault(self, fault: ScheduledFault) -> None:
        """Report that a component is made to fail."""
        name = fault.component
        self._publisher.event("fault.injected", name, f"{name}: {fault.kind.value} at {fault.at:g} s, as scheduled")

    def report_missed(self, name: str, why: str) -> None:
        """Report that a component could not be made to fail."""
        self._publisher.event("fault.missed", name, f"nothing is done to {name}: {why}")

    def _start_the_others(self, now: float) -> None:
        for other in self.processes.values():
            if other.incarnation == 0 and other.start_at is not None:
                other.start_at = min(other.start_at, now)

    # --- updates ---

    def take_update(self, update: UpdateSpecs) -> None:
        """Start components by new specs from now on; touches no process."""
        self.revision = update.revision
        self._see_to_trials(update)
        self.plan = self.plan.updated(update)
        for spec in update.specs:
            if spec.host == self.plan.name:
                self._take_spec(spec)
            elif spec.name in self.processes and not self.processes[spec.name].has_process:
                self.standby_runs.step_aside(spec.name)
        for name in self.processes.keys() & set(update.removed):
            self.processes[name].remove()

    def _see_to_trials(self, update: UpdateSpecs) -> None:
        """Keep what runs on trial continue from, and go back to that where they are undone."""
        self._trials.settle(update.revision)
        undone = self._trials.undo(update.undoes) if update.undoes is not None else {}
        for name, checkpoint in undone.items():
            managed = self.processes.get(name)
            if managed is not None:
                managed.checkpoint.go_back(checkpoint, managed.incarnation)
            else:
                self.past.go_back(name, checkpoint)
        for name in update.on_trial:
            managed = self.processes.get(name)
            before = managed.checkpoint.payload if managed is not None else self.past.checkpoint(name)
            self._trials.begin(name, update.revision, before)

    def _take_spec(self, spec: ComponentSpec) -> None:
        managed = self.processes.get(spec.name)
        aside = self.standby_runs.processes.get(spec.name)
        if managed is None and aside is not None and not aside.has_process:
            self.standby_runs.forget(aside)  # its record would keep another run from being started
            aside = None
        if managed is None and aside is not None and not aside.stopping:
            # The component comes back to the standby run; the adaptation that moves it decides when.
            aside.spec, aside.history.policy = spec.described_as(aside.spec), spec.restart
        elif managed is None:
            last = self.past.incarnation(spec.name)
            self.processes[spec.name] = ManagedProcess(spec, RestartHistory(spec.restart), incarnation=last)
        else:
            managed.spec, managed.history.policy = spec.described_as(managed.spec), spec.restart
            managed.keep(time.monotonic())

    def tell_soon(self) -> None:
        """Publish the status at the next look."""
        self._next_status = 0.0

    def status(self) -> HostStatus:
        """Return the host's status."""
        processes = tuple(self._status_of(managed) for _, managed in sorted(self.processes.items()))
        standby_runs = tuple(self._status_of(managed) for _, managed in sorted(self.standby_runs.processes.items()))
        return HostStatus(
            self.plan.name,
            self._clock.now() / 1e9,
            os.getpid(),
            processes,
            standby_runs,
            self.others_status(),
            self.term,
        )

    def others_status(self) -> tuple[OtherHost, ...]:
        """Return how the host sees others: only the first one does."""
        return ()

    def _status_of(self, managed: ManagedProcess) -> ProcessStatus:
        return managed.status(self.standby_runs.max_incarnation(managed.spec.name))
