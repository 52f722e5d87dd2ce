"""The host of one machine: one thread, one inbox, everything that happens to its components."""

from __future__ import annotations

import logging
import os
import signal
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from bus_schema.encoding import codec
from bus_schema.encoding.envelope import Envelope
from bus_schema.errors import SchemaError
from bus_schema.keys import Keys
from bus_schema.messages.health import ComponentStatus
from bus_schema.messages.host import HostStatus, JournalEnd, ProcessState, ProcessStatus, UpdateSpecs
from bus_schema.model.architecture import ComponentSpec
from regraft.bus import Bus, Closable, Sample
from regraft.clock import RealClock
from regraft.host.beside import ALONE_WITHIN, Beside
from regraft.host.describer import DESCRIBE, Describer
from regraft.host.logs import begin_anew_if_long, log_of
from regraft.host.past import PastRuns
from regraft.host.plan import HostPlan
from regraft.host.questions import Questions
from regraft.host.restarts import RestartHistory
from regraft.host.voice import Voice
from regraft.host.ward import Ward
from regraft.host.watching import LOOK_EVERY, Watching
from regraft.host.zygote import Zygote
from regraft.inbox import Inbox
from regraft.patience import Patience, stretched
from regraft.process import how_it_ended

STATUS_EVERY = 1.0
FIRST_BEAT_WITHIN = 15.0
END_WITHIN = 3.0
SOURCE_WITHIN = 5.0
MOST_STARTING = 32
"""Processes that start at a time: more would only wait for a processor, and keep it from this host."""
MOST_WAITING = 10_000
"""Items that may wait in the inbox, so that a flood of forged heartbeats does not fill the memory."""


class Host:
    """Starts, watches, restarts and ends the components of one machine."""

    def __init__(self, plan: HostPlan, bus: Bus, zygote: Zygote) -> None:
        """Nothing runs yet."""
        self.plan = plan
        self.term = 0
        self.journal = JournalEnd()
        self.revision = plan.architecture.revision
        self.wards = {name: Ward(spec, RestartHistory(spec.restart)) for name, spec in plan.mine().items()}
        self.past = PastRuns()
        self.beside = Beside(self.wards, self.past)
        self.inbox = Inbox()
        self.ended = False
        self._bus = bus
        self._zygote = zygote
        self._keys = Keys(plan.architecture.system)
        self._clock = RealClock()
        self._voice = Voice(bus, self._keys, plan.name, self._clock)
        self._watching = Watching(self._voice, zygote)
        self._log = logging.getLogger("host")
        self._next_status = 0.0
        self._next_look = 0.0
        self._source_up_by = 0.0
        self._declared: list[Closable] = []
        self.questions = Questions(self, Describer(zygote, plan.stack_folder, plan.folder))

    # --- life ---

    def start(self) -> None:
        """Appear on the bus and start everything: the time source first, since the others connect to it."""
        keys, name = self._keys, self.plan.name
        self._declared = [
            # The host looks often enough by itself: neither heartbeats nor checkpoints need to wake it.
            *(
                self._bus.subscribe(key, self.inbox.shelve)
                for key in (keys.status("*"), keys.standby("*"), keys.checkpoint("*"))
            ),
            *(self._bus.serve(keys.host(name, verb), self.inbox.put) for verb in (*self.questions.verbs, DESCRIBE)),
            self._bus.announce(keys.host(name, "alive")),
        ]
        threading.Thread(target=self._hear_zygote, daemon=True).start()
        now = time.monotonic()
        source = self.plan.source
        self._source_up_by = now + SOURCE_WITHIN if source else now
        for component, ward in self.wards.items():
            ward.start_at = now if component == source or source is None else self._source_up_by
        self.pump(0.0)

    def pump(self, timeout: float) -> None:
        """Do what is due, then handle what arrives within ``timeout`` seconds."""
        self._start_due()
        # Heartbeats first: nobody is silent whose heartbeat is here.
        for item in self.inbox.take_shelved():
            self._take(item)
        self._look()
        item = self.inbox.get(min(timeout, self._until_due()))
        until = time.monotonic() + LOOK_EVERY
        while item is not None:
            self._take(item)
            item = self.inbox.get(0.0) if time.monotonic() < until else None
        for _ in range(self.inbox.qsize() - MOST_WAITING):
            self._take(self.inbox.get(0.0), shed=True)

    def end(self) -> None:
        """End every process, the time source first: once time stands still, nobody misses those who leave.

        What does not end is killed after a while; everything is accounted for.
        """
        source = [ward for name, ward in self.wards.items() if name == self.plan.source]
        for wards in (source, self._all()):
            for ward in wards:
                self.ask_to_end(ward, stretched(END_WITHIN))
            patience = Patience(END_WITHIN + 1.0)
            while any(ward.has_process for ward in wards) and not patience.is_over():
                self.pump(LOOK_EVERY)
        self.ended = True
        self._zygote.close()

    def _until_due(self) -> float:
        now = time.monotonic()
        starts = [w.start_at - now for w in self._all() if w.start_at is not None] if self._room() else []
        return max(0.0, min([LOOK_EVERY, *starts]))

    def _take(self, item: Any, *, shed: bool = False) -> None:
        """Take what has arrived; ``shed`` drops samples: heartbeats and checkpoints come again."""
        if isinstance(item, dict):
            self._zygote_reports(item)
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

    # --- starting, ending, restarting ---

    @property
    def _logs(self) -> Path:
        return self.plan.folder / "logs"

    def _all(self) -> list[Ward]:
        return [*self.wards.values(), *self.beside.wards.values()]

    def _room(self) -> int:
        return max(0, MOST_STARTING - sum(ward.is_starting for ward in self._all()))

    def _start_due(self) -> None:
        now, room = time.monotonic(), self._room()
        for ward in self._all():
            self.beside.restart_if_alone(ward, now)
            if ward.start_at is not None and ward.start_at <= now and room:
                ward.start_at, room = None, room - 1
                self.spawn(ward)
            if ward.kill_at is not None and ward.kill_at <= now and ward.pid:
                ward.kill_at = None
                self._zygote.signal(ward.pid, signal.SIGKILL)

    def spawn(self, ward: Ward) -> None:
        """Start a process."""
        ward.incarnation = ward.begun = self.beside.next_number(ward)
        ward.formerly = ()
        ward.state, ward.seen, ward.stopping, ward.why_killed = ProcessState.STARTING, False, False, ""
        ward.started = self._clock.now() / 1e9
        log = str(log_of(self._logs, ward.spec.name))
        order = ward.order(self.plan, self.revision, self.term) | {"lease": self.lease_of(ward)}
        ward.awaited = False
        ward.succeeds = None  # whoever is restarted succeeds nobody that lives
        command, files = list(ward.spec.command) or None, self.plan.limits(ward.spec).files
        try:
            self._zygote.spawn(order, str(self.plan.stack_folder), log, command, files)
        except OSError:
            self._zygote_gone()
            return
        ward.ordered = True

    def lease_of(self, ward: Ward) -> str:
        """Return the path of the lease by which a process may act, empty if it always may."""
        return ""

    def _hear_zygote(self) -> None:
        """Pass on what the zygote reports, on a thread of its own, and that it is gone."""
        self._zygote.reports(self.inbox.put)
        self.inbox.put(self._zygote_gone)

    def _zygote_gone(self) -> None:
        """Everything it had started has ended with it."""
        if not self.ended:
            text = "the process that starts the others is gone: the system ends"
            self._voice.event("host.fault", self.plan.name, text)
        self.ended = True
        for ward in self._all():
            ward.ordered, ward.pid, ward.start_at, ward.kill_at = False, 0, None, None
            self._watching.forget(ward)

    def _zygote_reports(self, report: dict[str, Any]) -> None:
        if self.questions.describer.takes(report):
            return
        ward = self.beside.begun_as(report["name"], report["incarnation"])
        if ward is None:
            return
        ward.ordered = False
        if "started" in report:
            ward.pid = report["started"]
            if ward.stopping:
                self._zygote.signal(ward.pid, signal.SIGTERM)
            elif ward.spec.managed:
                timeout = self.plan.architecture.handler_timeout(ward.spec)
                self._watching.expect(ward, FIRST_BEAT_WITHIN + timeout, time.monotonic())
            else:
                ward.state = ProcessState.RUNNING
        else:
            self._process_ended(ward, report["code"])
        self._next_status = 0.0

    def _process_ended(self, ward: Ward, code: int) -> None:
        name = ward.spec.name
        self._watching.forget(ward)
        ward.pid, ward.kill_at = 0, None
        ward.last_end = ward.why_killed or how_it_ended(code)
        if self.beside.stands(ward):
            ward.state = ProcessState.STOPPED
            if ward.stopping:
                self.beside.forget(ward)
            return
        if ward.removed:
            # Asked to end, it is forgotten; ended by itself, it stays until it is asked to.
            ward.state, ward.owed = ProcessState.STOPPED, ward.history.wants_restart(code)
            if ward.stopping:
                self._forget(ward)
            return
        if ward.stopping:
            ward.state = ProcessState.STOPPED
            ward.start_at = time.monotonic() if ward.start_again else None
            return
        if self._is_elsewhere(name):
            ward.state = ProcessState.STOPPED
            return
        if not ward.history.wants_restart(code):
            ward.state = ProcessState.STOPPED
            self._voice.event("component.ended", name, f"{name} ended: {ward.last_end}")
            return
        if self.beside.awaits(ward):
            ward.state, ward.restart_by = ProcessState.STOPPED, time.monotonic() + ALONE_WITHIN
            text = f"{name} ended: {ward.last_end}; another run of it waits to go on"
            self._voice.event("component.ended", name, text)
            return
        ward.start_at = ward.history.next_start(time.monotonic())
        if ward.start_at is None:
            ward.state = ProcessState.QUARANTINED
            limit = f"{ward.spec.restart.limit} restarts in {ward.spec.restart.window:g} s"
            text = f"{name} ended: {ward.last_end}; it had {limit} and is left stopped until someone acts"
            self._voice.event("component.quarantined", name, text, incarnation=ward.incarnation)
            return
        ward.state = ProcessState.WAITING
        text = f"{name} ended: {ward.last_end}; it is restarted as incarnation {ward.incarnation + 1}"
        self._voice.event("component.restarted", name, text, incarnation=ward.incarnation + 1, ended=ward.last_end)

    def _is_elsewhere(self, name: str) -> bool:
        """Tell whether a component is placed on another host by now."""
        spec = self.plan.architecture.components.get(name)
        return spec is not None and spec.host != self.plan.name

    def _forget(self, ward: Ward) -> None:
        del self.wards[ward.spec.name]
        self.past.note(ward.spec.name, ward.incarnation, ward.checkpoint)
        self._watching.forget(ward)
        self._next_status = 0.0
        self._voice.event("component.removed", ward.spec.name, f"{ward.spec.name} was removed")

    def ask_to_end(self, ward: Ward, grace: float) -> None:
        """End a process, by force after ``grace`` seconds, and do not restart it."""
        ward.stopping, ward.start_again, ward.start_at, ward.restart_by = True, False, None, None
        if not ward.has_process:
            ward.state = ProcessState.STOPPED
            if self.beside.stands(ward):
                self.beside.forget(ward)
            elif ward.removed:
                self._forget(ward)
            return
        self._watching.forget(ward)
        ward.kill_at = time.monotonic() + grace
        if ward.pid:
            self._zygote.signal(ward.pid, signal.SIGTERM)
            self._zygote.signal(ward.pid, signal.SIGCONT)

    # --- watching ---

    def _look(self) -> None:
        now = time.monotonic()
        if now < self._next_look:
            return
        self._next_look = now + LOOK_EVERY
        self.questions.describer.look(now)
        self._watching.judge(now, self._all(), self.wards.get(self.plan.source or ""), self.plan.limits)
        if now >= self._next_status:
            self._next_status = now + STATUS_EVERY
            self._voice.status(self.status())
            for name in self.wards:
                begin_anew_if_long(log_of(self._logs, name))

    def _take_sample(self, sample: Sample) -> None:
        """Take a heartbeat or checkpoint; one of another incarnation speaks for the dead, or is forged."""
        name, kind = sample.key.split("/")[2:4]
        try:
            if name not in self.wards and name not in self.beside.wards:
                self.past.take(name, kind, sample)
            elif kind == "checkpoint":
                ward = self.beside.called(name, Envelope.from_bytes(sample.attachment).incarnation)
                if ward is not None:
                    ward.checkpoint = sample.payload
            else:
                ward = self.beside.called(name, codec.decode(sample.payload, ComponentStatus).incarnation)
                if ward is not None and ward.pid:
                    self._beats(ward)
        except SchemaError as error:
            self._log.warning("%s: %s", sample.key, error)

    def _beats(self, ward: Ward) -> None:
        now = time.monotonic()
        if ward.seen:
            self._watching.beat(ward, now)
            return
        ward.seen, ward.state = True, ProcessState.RUNNING
        self._next_status = 0.0
        if ward.stopping:
            return
        self._watching.expect(ward, self.plan.architecture.handler_timeout(ward.spec), now)
        if ward.spec.name == self.plan.source:
            self._start_the_others(now)

    def _start_the_others(self, now: float) -> None:
        for other in self.wards.values():
            if other.incarnation == 0 and other.start_at is not None:
                other.start_at = min(other.start_at, now)

    # --- telling ---

    def take_update(self, update: UpdateSpecs) -> None:
        """Start components as new specs say from now on; touches no process."""
        self.revision = update.revision
        self.plan = self.plan.updated(update)
        for spec in update.specs:
            if spec.host == self.plan.name:
                self._take_spec(spec)
            elif spec.name in self.wards and not self.wards[spec.name].has_process:
                self.beside.step_aside(spec.name)
        for name in self.wards.keys() & set(update.removed):
            self.wards[name].remove()

    def _take_spec(self, spec: ComponentSpec) -> None:
        ward = self.wards.get(spec.name)
        aside = self.beside.wards.get(spec.name)
        if ward is None and aside is not None and not aside.stopping:
            # The component comes back to the run that stands aside; whoever has it moved says when.
            aside.spec, aside.history.policy = spec.described_as(aside.spec), spec.restart
        elif ward is None:
            last = self.past.incarnation(spec.name)
            self.wards[spec.name] = Ward(spec, RestartHistory(spec.restart), incarnation=last)
        else:
            ward.spec, ward.history.policy = spec.described_as(ward.spec), spec.restart
            ward.keep(time.monotonic())

    def tell_soon(self) -> None:
        """Tell the status at the next look."""
        self._next_status = 0.0

    def status(self) -> HostStatus:
        """Return the host's status."""
        processes = tuple(self._status_of(ward) for _, ward in sorted(self.wards.items()))
        beside = tuple(self._status_of(ward) for _, ward in sorted(self.beside.wards.items()))
        return HostStatus(self.plan.name, self._clock.now() / 1e9, os.getpid(), processes, beside, term=self.term)

    def _status_of(self, ward: Ward) -> ProcessStatus:
        return replace(ward.status(), highest=self.beside.highest(ward.spec.name))
