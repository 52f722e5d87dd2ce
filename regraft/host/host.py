"""The host of one machine: one thread, one inbox, everything that happens to its components."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from typing import Any

from regraft.bus.inbox import Inbox
from regraft.bus.interface import Bus, Closable, Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.host.fault_injector import FaultInjector
from regraft.host.host_api import KEEP, HostApi
from regraft.host.host_publisher import HostPublisher
from regraft.host.plan import HostPlan
from regraft.host.runs.managed_process import ManagedProcess
from regraft.host.supervisor import Supervisor
from regraft.host.watchdog.process_killer import LOOK_INTERVAL
from regraft.host.watchdog.quality_watch import QualityWatch
from regraft.host.zygote.describer import Describer
from regraft.host.zygote.zygote import Zygote
from regraft.patience import Patience, stretched
from regraft.process.logs import HOST_LOG, begin_anew_if_long, log_of
from regraft.runtime.core.clock import RealClock

STATUS_INTERVAL = 1.0
END_TIMEOUT = 3.0
SOURCE_TIMEOUT = 5.0
MAX_WAITING = 10_000
"""Items of each kind that may wait, so that a flood of forged heartbeats does not fill the memory."""


class Host(Supervisor):
    """The host of one machine: it supervises its components, and answers questions on the bus.

    Heartbeats, checkpoints, qualities and the journal's end do not wake it: they are ``lazy``, and taken when it looks.
    In the middle of an adaptation it would take the processor from who has to answer; so the inbox, which hands lazy
    items on with the next question, does not get them.
    """

    def __init__(self, plan: HostPlan, bus: Bus, zygote: Zygote) -> None:
        self._bus = bus
        self._keys = Keys(plan.architecture.system)
        super().__init__(plan, zygote, HostPublisher(bus, self._keys, plan.name, RealClock()))
        self.inbox = Inbox()
        self.lazy: deque[Any] = deque()
        self._log = logging.getLogger("host")
        self._next_look = 0.0
        self._source_up_by = 0.0
        self._qualities = QualityWatch(self._publisher)
        self._declared: list[Closable] = []
        self.faults = FaultInjector(self, bus, self._keys, self.inbox.put)
        self.when_ended = self.faults.ended
        self.questions = HostApi(self, Describer(zygote, plan), self.faults, self.take_lazy)

    # --- life ---

    def start(self) -> None:
        """Appear on the bus and start everything: the time source first, since the others connect to it."""
        keys, name = self._keys, self.plan.name
        self._declared = [
            *(
                self._bus.subscribe(key, self.lazy.append)
                for key in (keys.status("*"), keys.standby("*"), keys.checkpoint("*"), keys.qualities("*"))
            ),
            *(
                self._bus.serve(keys.host(name, verb), self.lazy.append if verb == KEEP else self.inbox.put)
                for verb in (*self.questions.verbs, *self.questions.later)
            ),
            self._bus.announce(keys.host(name, "alive")),
        ]
        threading.Thread(target=self._hear_zygote, daemon=True).start()
        now = time.monotonic()
        source = self.plan.source
        self._source_up_by = now + SOURCE_TIMEOUT if source else now
        for component, managed in self.processes.items():
            managed.start_at = now if component == source or source is None else self._source_up_by
        self.pump(0.0)

    def pump(self, timeout: float) -> None:
        """Do what is due, then handle what arrives within ``timeout`` seconds."""
        self.start_due()
        self._look()
        item = self.inbox.get(min(timeout, self._until_due()))
        until = time.monotonic() + LOOK_INTERVAL
        while item is not None:
            self._take(item)
            item = self.inbox.get(0.0) if time.monotonic() < until else None
        for _ in range(self.inbox.qsize() - MAX_WAITING):
            self._take(self.inbox.get(0.0), shed=True)

    def end(self) -> None:
        """End every process, the time source first: once time is still, nobody misses those who leave.

        A process that does not end is killed after a while; everything is accounted for.
        """
        source = [managed for name, managed in self.processes.items() if name == self.plan.source]
        for processes in (source, self.all_processes()):
            for managed in processes:
                self.ask_to_end(managed, stretched(END_TIMEOUT))
            patience = Patience(END_TIMEOUT + 1.0)
            while any(managed.has_process for managed in processes) and not patience.is_over():
                self.pump(LOOK_INTERVAL)
        self.ended = True
        self._zygote.close()

    def _until_due(self) -> float:
        now = time.monotonic()
        starts = [w.start_at for w in self.all_processes() if w.start_at is not None] if self.room() else []
        return max(0.0, min([self._next_look, *starts]) - now)

    def spawn(self, managed: ManagedProcess) -> None:
        """Start a process, from the last checkpoint that has come."""
        self.take_lazy()
        super().spawn(managed)

    def take_lazy(self) -> None:
        """Take what has not woken the host; of a flood, samples go by."""
        for _ in range(len(self.lazy)):
            self._take(self.lazy.popleft(), shed=len(self.lazy) > MAX_WAITING)

    def _take(self, item: Any, *, shed: bool = False) -> None:
        """Take what has arrived; ``shed`` drops samples: heartbeats and checkpoints come again."""
        if isinstance(item, dict):
            if "started" not in item:
                self.take_lazy()  # the last checkpoint of what has ended may be among it
            if not self.questions.describer.takes(item):
                self.zygote_reports(item)
            return
        sample = self._bus.open_sample(item)
        if sample is not None:
            if not shed:
                self._take_sample(sample)
            return
        query = self._bus.open_query(item)
        if query is not None:
            self.questions.answer(query)
        elif callable(item):
            item()

    def _hear_zygote(self) -> None:
        """Pass on what the zygote reports, on a thread of its own, and that it is gone."""
        self._zygote.reports(self.inbox.put)
        self.inbox.put(self.zygote_gone)

    # --- watching ---

    def _look(self) -> None:
        now = time.monotonic()
        if now < self._next_look:
            return
        self._next_look = now + LOOK_INTERVAL
        self.take_lazy()  # nobody is silent whose heartbeat is here
        self.questions.describer.look(now)
        self._killer.judge(now, self.all_processes(), self.processes.get(self.plan.source or ""), self.plan.limits)
        if now >= self._next_status:
            self._next_status = now + STATUS_INTERVAL
            self._publisher.status(self.status())
            self._qualities.forget_all_but(self.processes.__contains__)
            for log in (*(log_of(self.log_folder, name) for name in self.processes), self.log_folder / HOST_LOG):
                begin_anew_if_long(log)

    def _take_sample(self, sample: Sample) -> None:
        """Take a heartbeat, checkpoint or measurement; one of another incarnation speaks for the dead, or is forged."""
        name, kind = sample.key.split("/")[2:4]
        try:
            if kind == "qualities":
                self._qualities.measured(codec.decode(sample.payload, MeasuredQualities))
            elif name not in self.processes and name not in self.standby_runs.processes:
                self.past.take(name, kind, sample)
            elif kind == "checkpoint":
                incarnation = Envelope.from_bytes(sample.attachment).incarnation
                managed = self.standby_runs.called(name, incarnation)
                if managed is not None:
                    managed.checkpoint.take(sample.payload, incarnation)
                elif name not in self.processes:
                    self.past.take(name, kind, sample)  # the run that speaks is elsewhere
            else:
                status = codec.decode(sample.payload, ComponentStatus)
                managed = self.standby_runs.called(name, status.incarnation)
                if managed is not None and managed.pid:
                    self.beats(managed)
                    self._qualities.beats(managed.spec, status)
        except SchemaError as error:
            self._log.warning("%s: %s", sample.key, error)
