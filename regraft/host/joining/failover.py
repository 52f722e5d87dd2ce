"""Has the components of a lost host started elsewhere: asked of the adaptation manager, on a thread of its own."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from regraft.bus.interface import Bus, BusError
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.bus_schema.model.adaptation import (
    ADAPT,
    APPLIED,
    JOURNAL,
    AdaptationReport,
    AdaptationRequest,
    Move,
    Outcome,
)
from regraft.client import Client
from regraft.component.errors import CallFailed

ANSWER_TIMEOUT = 10.0
KEEP_TRYING = 60.0
"""Seconds for which a manager that does not answer is looked for: it may have to be restarted itself."""
RETRY_INTERVAL = 0.5


class Failover:
    """Asks for adaptations in the name of the first host."""

    def __init__(self, bus: Bus, system: str, tell: Callable[[str, str, str], None]) -> None:
        """Ask on ``bus``; failures are reported by ``tell(kind, subject, text)``, on any thread."""
        self._bus = bus
        self._system = system
        self._tell = tell

    def begin(self, host: str, target: str, components: Sequence[str]) -> None:
        """Have the components of a lost host moved."""
        args = (host, target, tuple(components))
        threading.Thread(target=self._move, args=args, name="failover", daemon=True).start()

    def _move(self, host: str, target: str, components: tuple[str, ...]) -> None:
        loss = secrets.token_hex(4)
        with Client(self._bus, self._system, f"host-local-{loss}") as client:
            problem = self._asked(client, host, loss, target, components)
            if problem and len(components) > 1:
                # All together is best: what needs each other starts with each other. Otherwise each that can.
                alone = [self._asked(client, host, loss, target, (name,)) for name in components]
                problem = "; ".join(filter(None, alone))
        if problem:
            self._tell("host.stranded", host, f"not everything of host {host} could be started on {target}: {problem}")

    def _asked(self, client: Client, host: str, loss: str, target: str, components: tuple[str, ...]) -> str:
        """Ask until there is an answer; returns what is wrong, empty if nothing.

        The same ``loss`` asked about again is the same adaptation. Where it was rolled back after a question without a
        reply, the manager's own end may have interrupted it: another one is asked for, once.
        """
        changes = tuple(Move(name, target) for name in components)
        key = f"lost-{loss}-{host}-{'-'.join(components)}"[:200]
        request = AdaptationRequest(changes, f"host {host!r} is lost", "the stack's rules for hosts", key=key)
        deadline = time.monotonic() + KEEP_TRYING
        may_be_interrupted = False
        while True:
            try:
                report = client.call(ADAPT, request, AdaptationReport, ANSWER_TIMEOUT)
            except (CallFailed, BusError, SchemaError) as error:
                if _is_without_reply(error) and _is_there(client):
                    deadline = time.monotonic() + KEEP_TRYING  # it waits for its turn: others are being confirmed
                if time.monotonic() > deadline:
                    return f"{', '.join(components)}: {error}"
                may_be_interrupted = True
                time.sleep(RETRY_INTERVAL)
                continue
            if report.outcome in APPLIED:
                return ""
            if report.outcome is Outcome.ROLLED_BACK and may_be_interrupted and request.key == key:
                request = replace(request, key=f"again-{key}"[:200])
                continue
            told = [f"{v.component}: {v.problem}" for v in report.violations] or [report.error]
            return f"{', '.join(components)}: {report.outcome.value}: {'; '.join(told)}"


def _is_without_reply(error: Exception) -> bool:
    return isinstance(error, CallFailed) and error.answer is None


def _is_there(client: Client) -> bool:
    """Return whether the manager answers questions."""
    try:
        client.call(JOURNAL, JournalRequest(limit=1), JournalPage, ANSWER_TIMEOUT)
    except (CallFailed, BusError, SchemaError):
        return False
    return True
