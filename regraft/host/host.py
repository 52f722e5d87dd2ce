"""The host of one machine: one thread, one inbox, everything that happens to its components."""

from __future__ import annotations

import logging
import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

from bus_schema import codec
from bus_schema.architecture import ComponentSpec
from bus_schema.envelope import Envelope
from bus_schema.errors import BadMessage, SchemaError
from bus_schema.keys import Keys
from bus_schema.messages.control import ControlCode
from bus_schema.messages.health import ComponentStatus
from bus_schema.messages.host import HostStatus, HostView, ProcessState, StartComponent, StopComponent, UpdateSpecs
from regraft.bus import Bus, Closable, Query, Sample
from regraft.clock import RealClock
from regraft.host.describing import DESCRIBE, Describer
from regraft.host.logs import tail
from regraft.host.plan import HostPlan
from regraft.host.restarts import RestartHistory
from regraft.host.silence import HUNG_AFTER, Silence
from regraft.host.voice import Fenced, UnknownComponent, Voice, refuse
from regraft.host.ward import Ward
from regraft.host.zygote import Zygote, how_it_ended
from regraft.inbox import Inbox

LOOK_EVERY = 0.05
STATUS_EVERY = 1.0
FIRST_BEAT_WITHIN = 15.0
END_WITHIN = 3.0
SOURCE_WITHIN = 5.0
LARGEST_INCARNATION = 2**32 - 1
"""What an envelope has room for."""
MOST_WAITING = 10_000
"""Items that may wait in the inbox, so that a flood of forged heartbeats does not fill the memory."""


class Host:
    """Starts, watches, restarts and ends the components of one machine."""

    def __init__(self, plan: HostPlan, bus: Bus, zygote: Zygote) -> None:
        """Nothing runs yet."""
        self.plan = plan
        self.term = 0
        self.revision = plan.architecture.revision
        self.wards = {name: Ward(spec, RestartHistory(spec.restart)) for name, spec in plan.mine().items()}
        self.inbox = Inbox()
        self.ended = False
        self._bus = bus
        self._zygote = zygote
        self._keys = Keys(plan.architecture.system)
        self._clock = RealClock()
        self._voice = Voice(bus, self._keys, plan.name, self._clock)
        self._silence = Silence()
        self._log = logging.getLogger("host")
        self._next_status = 0.0
        self._next_look = 0.0
        self._source_up_by = 0.0
        self._declared: list[Closable] = []
        self._past: dict[str, Ward] = {}
        self._describer = Describer(zygote, plan.stack_folder, plan.folder)
        self._verbs: dict[str, Callable[[bytes], object]] = {
            "view": self._view,
            "specs": self._update,
            "start": self._start_asked,
            "stop": self._stop_asked,
            "logs": self._logs,
        }

    # --- life ---

    def start(self) -> None:
        """Appear on the bus and start everything: the time source first, since the others connect to it."""
        keys, name = self._keys, self.plan.name
        self._declared = [
            # The host looks often enough by itself: neither heartbeats nor checkpoints need to wake it.
            *(self._bus.subscribe(key, self.inbox.shelve) for key in (keys.status("*"), keys.checkpoint("*"))),
            *(self._bus.serve(keys.host(name, verb), self.inbox.put) for verb in (*self._verbs, DESCRIBE)),
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
        for wards in (source, list(self.wards.values())):
            for ward in wards:
                self._ask_to_end(ward, END_WITHIN)
            deadline = time.monotonic() + END_WITHIN + 1.0
            while any(ward.has_process for ward in wards) and time.monotonic() < deadline:
                self.pump(LOOK_EVERY)
        self.ended = True
        self._zygote.close()

    def _until_due(self) -> float:
        now = time.monotonic()
        starts = [w.start_at - now for w in self.wards.values() if w.start_at is not None]
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
            self._answer(query)
        elif callable(item):
            item()

    # --- starting, ending, restarting ---

    def _start_due(self) -> None:
        now = time.monotonic()
        for ward in self.wards.values():
            if ward.start_at is not None and ward.start_at <= now:
                ward.start_at = None
                self._spawn(ward)
            if ward.kill_at is not None and ward.kill_at <= now and ward.pid:
                ward.kill_at = None
                self._zygote.signal(ward.pid, signal.SIGKILL)

    def _spawn(self, ward: Ward) -> None:
        ward.incarnation += 1
        ward.state, ward.seen, ward.stopping, ward.why_killed = ProcessState.STARTING, False, False, ""
        ward.started = self._clock.now() / 1e9
        log = str(self.plan.folder / "logs" / f"{ward.spec.name}.log")
        order = ward.order(self.plan, self.revision, self.term)
        try:
            self._zygote.spawn(order, str(self.plan.stack_folder), log, list(ward.spec.command) or None)
        except OSError:
            self._zygote_gone()
            return
        ward.ordered = True

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
        for ward in self.wards.values():
            ward.ordered, ward.pid, ward.start_at, ward.kill_at = False, 0, None, None
            self._silence.forget(ward.spec.name)

    def _zygote_reports(self, report: dict[str, Any]) -> None:
        if self._describer.takes(report):
            return
        ward = self.wards.get(report["name"])
        if ward is None or report["incarnation"] != ward.incarnation:
            return
        ward.ordered = False
        if "started" in report:
            ward.pid = report["started"]
            if ward.stopping:
                self._zygote.signal(ward.pid, signal.SIGTERM)
            elif ward.spec.managed:
                self._silence.watch(ward.spec.name, ward.pid, FIRST_BEAT_WITHIN, time.monotonic())
            else:
                ward.state = ProcessState.RUNNING
        else:
            self._process_ended(ward, report["code"])
        self._next_status = 0.0

    def _process_ended(self, ward: Ward, code: int) -> None:
        name = ward.spec.name
        self._silence.forget(name)
        ward.pid, ward.kill_at = 0, None
        ward.last_end = ward.why_killed or how_it_ended(code)
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
        if not ward.history.wants_restart(code):
            ward.state = ProcessState.STOPPED
            self._voice.event("component.ended", name, f"{name} ended: {ward.last_end}")
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

    def _forget(self, ward: Ward) -> None:
        del self.wards[ward.spec.name]
        self._past[ward.spec.name] = ward
        self._silence.forget(ward.spec.name)
        self._next_status = 0.0
        self._voice.event("component.removed", ward.spec.name, f"{ward.spec.name} was removed")

    def _ask_to_end(self, ward: Ward, grace: float) -> None:
        ward.stopping, ward.start_again, ward.start_at = True, False, None
        if not ward.has_process:
            ward.state = ProcessState.STOPPED
            if ward.removed:
                self._forget(ward)
            return
        self._silence.forget(ward.spec.name)
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
        self._describer.look(now)
        for name in self._silence.hung(now, self.plan.source):
            ward = self.wards[name]
            ward.why_killed = (
                "its loop hung, so it was killed" if ward.seen else "it never said a word, so it was killed"
            )
            self._silence.forget(name)
            self._voice.event("component.hung", name, f"{name} gives no sign of life: {ward.why_killed}")
            self._zygote.signal(ward.pid, signal.SIGKILL)
        if now >= self._next_status:
            self._next_status = now + STATUS_EVERY
            self._voice.status(self.status())

    def _take_sample(self, sample: Sample) -> None:
        parts = sample.key.split("/")
        ward = self.wards.get(parts[2])
        if ward is None:
            return
        try:
            if parts[3] == "checkpoint":
                if Envelope.from_bytes(sample.attachment).incarnation == ward.incarnation:
                    ward.checkpoint = sample.payload
            elif parts[3] == "status":
                self._take_status(ward, codec.decode(sample.payload, ComponentStatus))
        except SchemaError as error:
            self._log.warning("%s: %s", sample.key, error)

    def _take_status(self, ward: Ward, status: ComponentStatus) -> None:
        """Take a heartbeat; one of another incarnation speaks for the dead, or is forged, and counts for nothing."""
        if status.incarnation != ward.incarnation or not ward.pid:
            return
        now = time.monotonic()
        if ward.seen:
            self._silence.beat(ward.spec.name, now)
            return
        ward.seen, ward.state = True, ProcessState.RUNNING
        self._next_status = 0.0
        if ward.stopping:
            return
        longest = ward.spec.description.longest_handler if ward.spec.description else HUNG_AFTER
        self._silence.watch(ward.spec.name, ward.pid, longest, now)
        if ward.spec.name == self.plan.source:
            self._start_the_others(now)

    def _start_the_others(self, now: float) -> None:
        for other in self.wards.values():
            if other.incarnation == 0 and other.start_at is not None:
                other.start_at = min(other.start_at, now)

    # --- what is asked of the host ---

    def _answer(self, query: Query) -> None:
        verb = query.key.rsplit("/", 1)[-1]
        try:
            if verb == DESCRIBE:
                self._describer.ask(query)
                return
            if verb not in self._verbs:
                raise UnknownComponent(f"there is no such question; there are: {', '.join((*self._verbs, DESCRIBE))}")
            query.reply(codec.encode(self._verbs[verb](query.payload)))
        except Fenced as error:
            refuse(query, ControlCode.FENCED, str(error))
        except (SchemaError, UnknownComponent) as error:
            refuse(query, ControlCode.MALFORMED, f"{verb}: {error}")
        except Exception as error:
            self._log.exception("%s failed", verb)
            refuse(query, ControlCode.FAILED, f"{verb}: {type(error).__name__}: {error}")

    def _fence(self, term: int | None) -> None:
        if term is None or term < self.term:
            raise Fenced(f"came with {'no term' if term is None else f'term {term}'}; the current term is {self.term}")
        self.term = term

    def _view(self, _: bytes) -> HostView:
        specs = tuple(ward.spec for ward in self.wards.values() if not ward.removed)
        return HostView(self.plan.name, self.plan.run, self.term, self.plan.architecture, specs)

    def _update(self, payload: bytes) -> HostStatus:
        update = codec.decode(payload, UpdateSpecs)
        self._fence(update.term)
        self.revision = update.revision
        self.plan = self.plan.updated(update)
        for spec in update.specs:
            if spec.host == self.plan.name:
                self._take_spec(spec)
        for name in self.wards.keys() & set(update.removed):
            self.wards[name].remove()
        return self.status()

    def _take_spec(self, spec: ComponentSpec) -> None:
        ward = self.wards.get(spec.name)
        if ward is None:
            last = self._past[spec.name].incarnation if spec.name in self._past else 0
            self.wards[spec.name] = Ward(spec, RestartHistory(spec.restart), incarnation=last)
        else:
            ward.spec, ward.history.policy = spec.described_as(ward.spec), spec.restart
            ward.keep(time.monotonic())

    def _start_asked(self, payload: bytes) -> HostStatus:
        asked = codec.decode(payload, StartComponent)
        if asked.incarnation is not None and asked.incarnation > LARGEST_INCARNATION:
            raise BadMessage(f"incarnation: is {asked.incarnation}, must be at most {LARGEST_INCARNATION}")
        self._fence(asked.term)
        ward = self._ward(asked.component)
        if ward.removed:
            raise UnknownComponent(f"component {asked.component!r} is being removed")
        if not ward.has_process and ward.start_at is None:
            ward.history.pardon()
            if asked.resume and ward.spec.name in self._past:
                ward.checkpoint = self._past[ward.spec.name].checkpoint
            if asked.incarnation is not None:
                ward.incarnation = max(ward.incarnation, asked.incarnation - 1)
            ward.start_at, ward.state = time.monotonic(), ProcessState.WAITING
        elif ward.stopping:
            ward.start_again = True
        return self.status()

    def _stop_asked(self, payload: bytes) -> HostStatus:
        asked = codec.decode(payload, StopComponent)
        self._fence(asked.term)
        self._ask_to_end(self._ward(asked.component), asked.grace)
        return self.status()

    def _ward(self, name: str) -> Ward:
        if name not in self.wards:
            raise UnknownComponent(f"there is no component {name!r} on host {self.plan.name!r}")
        return self.wards[name]

    def _logs(self, payload: bytes) -> object:
        return tail(self.plan.folder / "logs", payload)

    def status(self) -> HostStatus:
        """Return the host's status."""
        processes = tuple(ward.status() for _, ward in sorted(self.wards.items()))
        return HostStatus(self.plan.name, self._clock.now() / 1e9, os.getpid(), processes)
