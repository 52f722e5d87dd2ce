"""What is asked of a host: who may ask, what is done, what is answered."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from bus_schema.encoding import codec
from bus_schema.errors import BadMessage, SchemaError
from bus_schema.messages.control import ControlCode
from bus_schema.messages.host import (
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
from regraft.bus import Query
from regraft.fencing import Fenced, in_force
from regraft.host.describer import DESCRIBE, Describer
from regraft.host.logs import tail
from regraft.host.voice import Refused, UnknownComponent, refuse
from regraft.host.ward import Ward

if TYPE_CHECKING:
    from regraft.host.host import Host

LARGEST_INCARNATION = 2**32 - 1
"""What an envelope has room for."""


class Questions:
    """Answers the queries to one host, by ``verbs``."""

    def __init__(self, host: Host, describer: Describer) -> None:
        """Nobody has asked yet."""
        self.describer = describer
        self._host = host
        self._log = logging.getLogger("host")
        self.verbs: dict[str, Callable[[bytes], object]] = {
            "view": self._view,
            "runs": lambda _: self._host.status(),
            "specs": self._update,
            "journal": self._keep_end,
            "start": self.start,
            "stop": self._stop_asked,
            "logs": self._logs,
            "succeed": self._start_successor,
            "speak": self._let_speak,
        }

    def answer(self, query: Query) -> None:
        """Answer a query, or begin to."""
        verb = query.key.rsplit("/", 1)[-1]
        try:
            if verb == DESCRIBE:
                self.describer.ask(query)
                return
            if verb not in self.verbs:
                raise UnknownComponent(f"there is no such question; there are: {', '.join((*self.verbs, DESCRIBE))}")
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
        self._host.term = in_force(term, self._host.term)

    def _view(self, _: bytes) -> HostView:
        specs = tuple(ward.spec for ward in self._host.wards.values() if not ward.removed)
        host, plan = self._host, self._host.plan
        return HostView(plan.name, plan.run, host.term, plan.architecture, specs, host.revision, host.journal)

    def _update(self, payload: bytes) -> HostStatus:
        update = codec.decode(payload, UpdateSpecs)
        self._fence(update.term)
        self._host.take_update(update)
        return self._host.status()

    def _keep_end(self, payload: bytes) -> JournalEnd:
        end = codec.decode(payload, JournalEnd)
        self._fence(end.term)
        self._host.journal = end
        return end

    def start(self, payload: bytes) -> HostStatus:
        """Start a component, as somebody asks by StartComponent; raises BadMessage, Fenced, UnknownComponent."""
        asked = codec.decode(payload, StartComponent)
        if asked.incarnation is not None and asked.incarnation > LARGEST_INCARNATION:
            raise BadMessage(f"incarnation: is {asked.incarnation}, must be at most {LARGEST_INCARNATION}")
        self._fence(asked.term)
        ward = self._ward(asked.component)
        if ward.removed:
            raise UnknownComponent(f"component {asked.component!r} is being removed")
        if not ward.has_process and ward.start_at is None:
            ward.history.pardon()
            if asked.resume:
                ward.checkpoint = self._host.past.checkpoint(ward.spec.name)
            if asked.afresh:
                ward.checkpoint = b""
            ward.incarnation += asked.leave_out
            if asked.incarnation is not None:
                ward.incarnation = max(ward.incarnation, asked.incarnation - 1)
            ward.start_at, ward.state = time.monotonic(), ProcessState.WAITING
        elif ward.stopping:
            ward.start_again = True
        return self._host.status()

    def _stop_asked(self, payload: bytes) -> HostStatus:
        asked = codec.decode(payload, StopComponent)
        self._fence(asked.term)
        name = asked.component
        ward = self._ward(name) if asked.begun is None else self._host.beside.begun_as(name, asked.begun)
        if ward is not None:  # a run that is not known any more has ended
            self._host.ask_to_end(ward, asked.grace)
        return self._host.status()

    def _start_successor(self, payload: bytes) -> HostStatus:
        asked = codec.decode(payload, StartSuccessor)
        if asked.incarnation > LARGEST_INCARNATION:
            raise BadMessage(f"incarnation: is {asked.incarnation}, must be at most {LARGEST_INCARNATION}")
        self._fence(asked.term)
        if asked.spec.host == self._host.plan.name:
            self._host.spawn(self._host.beside.add(asked))
        else:
            self._host.beside.expect(asked)
        return self._host.status()

    def _let_speak(self, payload: bytes) -> HostStatus:
        asked = codec.decode(payload, LetSpeak)
        if asked.above is not None and asked.above >= LARGEST_INCARNATION:
            raise BadMessage(f"above: is {asked.above}, must be lower than {LARGEST_INCARNATION}")
        self._fence(asked.term)
        if asked.host in ("", self._host.plan.name):
            self._host.beside.let_speak(asked)
        else:
            self._host.beside.step_aside(asked.component)
        self._host.tell_soon()
        return self._host.status()

    def _ward(self, name: str) -> Ward:
        if name not in self._host.wards:
            raise UnknownComponent(f"there is no component {name!r} on host {self._host.plan.name!r}")
        return self._host.wards[name]

    def _logs(self, payload: bytes) -> object:
        return tail(self._host.plan.folder / "logs", payload)
