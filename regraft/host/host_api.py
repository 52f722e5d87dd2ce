"""The host's API: who may ask, what is done, what is answered."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

from regraft.bus.interface import Query
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import MAX_INCARNATION
from regraft.bus_schema.errors import BadMessage, SchemaError
from regraft.bus_schema.messages.protocol.control import ControlCode
from regraft.bus_schema.messages.protocol.host import (
    HostStatus,
    HostView,
    JournalEnd,
    LetSpeak,
    ProcessState,
    StartComponent,
    StartSuccessor,
    StopComponent,
    UpdateSpecs,
)
from regraft.host.fault_injector import INJECT, FaultInjector
from regraft.host.host_publisher import Refused, UnknownComponent, refuse
from regraft.host.runs.managed_process import ManagedProcess
from regraft.host.supervisor import Supervisor
from regraft.host.watchdog.usage import Usage
from regraft.host.zygote.describer import DESCRIBE, ESTIMATE, Describer
from regraft.process.logs import tail
from regraft.runtime.core.terms import Fenced, in_force

KEEP, SPECS = "journal", "specs"
"""The verbs that give the host the journal's end, and new specs; without any it is asked what it runs."""


class HostApi:
    """Answers the queries to one host, by ``verbs``; what takes a while is answered ``later``.

    ``catch_up`` takes what has come without waking the host. It is called before every answer, but to new specs of
    components that run: their manager waits for it.
    """

    def __init__(
        self, supervisor: Supervisor, describer: Describer, faults: FaultInjector, catch_up: Callable[[], None]
    ) -> None:
        self.describer = describer
        self.later: dict[str, Callable[[Query], object]] = {
            DESCRIBE: describer.ask,
            ESTIMATE: describer.ask_estimates,
            INJECT: faults.ask,
        }
        self._supervisor = supervisor
        self._catch_up = catch_up
        self._log = logging.getLogger("host")
        self._usage = Usage()
        self.verbs: dict[str, Callable[[bytes], object]] = {
            "view": self._view,
            "runs": lambda _: self._supervisor.status(),
            SPECS: self._update,
            KEEP: self._keep_end,
            "start": self.start,
            "stop": self._stop_asked,
            "logs": self._logs,
            "succeed": self._start_successor,
            "speak": self._let_speak,
            "usage": lambda _: self._usage.measure(self._supervisor.plan.name, self._supervisor.all_processes()),
            "bring_back": faults.bring_back,
        }

    def answer(self, query: Query) -> None:
        """Answer a query, or begin to."""
        verb = query.key.rsplit("/", 1)[-1]
        try:
            if verb not in (KEEP, SPECS):
                self._catch_up()
            if verb in self.later:
                self.later[verb](query)
                return
            if verb not in self.verbs:
                known = ", ".join((*self.verbs, *self.later))
                raise UnknownComponent(f"there is no such question; there are: {known}")
            query.reply(codec.encode(self.verbs[verb](query.payload)))
        except Fenced as error:
            refuse(query, ControlCode.FENCED, str(error))
        except Refused as error:
            refuse(query, error.code, str(error))
        except (SchemaError, UnknownComponent) as error:
            refuse(query, ControlCode.MALFORMED, f"{verb}: {error}")
        except Exception as error:
            self._log.exception("%s failed", verb)
            refuse(query, ControlCode.FAILED, f"{verb}: {type(error).__name__}: {error}")

    def _fence(self, term: int | None) -> None:
        self._supervisor.term = in_force(term, self._supervisor.term)

    def _view(self, _: bytes) -> HostView:
        specs = tuple(managed.spec for managed in self._supervisor.processes.values() if not managed.removed)
        host, plan = self._supervisor, self._supervisor.plan
        return HostView(plan.name, plan.run, host.term, plan.architecture, specs, host.revision, host.journal)

    def _update(self, payload: bytes) -> HostStatus:
        update = codec.decode(payload, UpdateSpecs)
        running = all(spec.name in self._supervisor.processes for spec in update.specs)
        if not (update.specs and running) or update.on_trial or update.undoes is not None:
            self._catch_up()
        self._fence(update.term)
        self._supervisor.take_update(update)
        return self._supervisor.status()

    def _keep_end(self, payload: bytes) -> JournalEnd:
        end = codec.decode(payload, JournalEnd)
        self._fence(end.term)
        self._supervisor.journal = end
        return end

    def start(self, payload: bytes) -> HostStatus:
        """Start a component, as somebody asks by StartComponent; raises BadMessage, Fenced, UnknownComponent."""
        asked = codec.decode(payload, StartComponent)
        if asked.incarnation is not None and asked.incarnation > MAX_INCARNATION:
            raise BadMessage(f"incarnation: is {asked.incarnation}, must be at most {MAX_INCARNATION}")
        self._fence(asked.term)
        managed = self._managed(asked.component)
        if managed.removed:
            raise UnknownComponent(f"component {asked.component!r} is being removed")
        if not managed.has_process and managed.start_at is None:
            managed.history.pardon()
            if asked.resume:
                managed.checkpoint.resume(self._supervisor.past.checkpoint(managed.spec.name))
            if asked.afresh:
                managed.checkpoint.forget()
            managed.incarnation += asked.leave_out
            if asked.incarnation is not None:
                managed.incarnation = max(managed.incarnation, asked.incarnation - 1)
            managed.start_at, managed.state = time.monotonic(), ProcessState.WAITING
        elif managed.stopping:
            managed.start_again = True
        return self._supervisor.status()

    def _stop_asked(self, payload: bytes) -> HostStatus:
        asked = codec.decode(payload, StopComponent)
        self._fence(asked.term)
        name = asked.component
        managed = (
            self._managed(name)
            if asked.started_as is None
            else self._supervisor.standby_runs.run_of(name, asked.started_as)
        )
        if managed is not None:  # a run that is not known any more has ended
            self._supervisor.ask_to_end(managed, asked.grace)
        return self._supervisor.status()

    def _start_successor(self, payload: bytes) -> HostStatus:
        asked = codec.decode(payload, StartSuccessor)
        if asked.incarnation > MAX_INCARNATION:
            raise BadMessage(f"incarnation: is {asked.incarnation}, must be at most {MAX_INCARNATION}")
        self._fence(asked.term)
        if asked.spec.host == self._supervisor.plan.name:
            self._supervisor.spawn(self._supervisor.standby_runs.add(asked))
        else:
            self._supervisor.standby_runs.expect(asked)
        return self._supervisor.status()

    def _let_speak(self, payload: bytes) -> HostStatus:
        asked = codec.decode(payload, LetSpeak)
        if asked.above is not None and asked.above >= MAX_INCARNATION:
            raise BadMessage(f"above: is {asked.above}, must be lower than {MAX_INCARNATION}")
        self._fence(asked.term)
        if asked.host in ("", self._supervisor.plan.name):
            self._supervisor.standby_runs.let_speak(asked)
        else:
            self._supervisor.standby_runs.step_aside(asked.component)
        self._supervisor.tell_soon()
        return self._supervisor.status()

    def _managed(self, name: str) -> ManagedProcess:
        if name not in self._supervisor.processes:
            raise UnknownComponent(f"there is no component {name!r} on host {self._supervisor.plan.name!r}")
        return self._supervisor.processes[name]

    def _logs(self, payload: bytes) -> object:
        return tail(self._supervisor.plan.folder / "logs", payload)
