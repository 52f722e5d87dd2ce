"""Has the components of a lost host started elsewhere: asked of the adaptation manager, on a thread of its own."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from regraft.bus.interface import Bus, BusError
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.messages.management.manager import CancelAdaptation, JournalPage, JournalRequest
from regraft.bus_schema.model.adaptation import (
    ADAPT,
    APPLIED,
    CANCEL,
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


@dataclass(slots=True)
class _Rescue:
    """The moves asked for after one loss. ``waiting`` is the adaptation asked for last, empty if its id is unknown."""

    loss: str
    host: str
    target: str
    waiting: str = ""
    withdrawn: bool = False


class Failover:
    """Asks for adaptations in the name of the first host."""

    def __init__(self, bus: Bus, system: str, tell: Callable[[str, str, str], None]) -> None:
        """Ask on ``bus``; failures are reported by ``tell(kind, subject, text)``, on any thread."""
        self._bus = bus
        self._system = system
        self._tell = tell
        self._rescues: dict[str, list[_Rescue]] = {}

    def begin(self, host: str, target: str, components: Sequence[str]) -> None:
        """Have the components of a lost host moved."""
        rescue = _Rescue(secrets.token_hex(4), host, target)
        self._rescues.setdefault(host, []).append(rescue)
        args = (rescue, tuple(components))
        threading.Thread(target=self._move, args=args, name="failover", daemon=True).start()

    def withdraw(self, host: str) -> None:
        """Have nothing more started elsewhere: the host is back. A move under way is brought to its end."""
        for rescue in self._rescues.pop(host, []):
            rescue.withdrawn = True
            threading.Thread(target=self._withdraw, args=(rescue,), name="withdrawal", daemon=True).start()

    def _move(self, rescue: _Rescue, components: tuple[str, ...]) -> None:
        with Client(self._bus, self._system, f"host-local-{rescue.loss}") as client:
            problem = self._asked(client, rescue, components)
            if problem and len(components) > 1:
                # All together is best: what needs each other starts with each other. Otherwise each that can.
                alone = [self._asked(client, rescue, (name,)) for name in components]
                problem = "; ".join(filter(None, alone))
        if problem and not rescue.withdrawn:
            told = f"not everything of host {rescue.host} could be started on {rescue.target}: {problem}"
            self._tell("host.stranded", rescue.host, told)

    def _asked(self, client: Client, rescue: _Rescue, components: tuple[str, ...]) -> str:
        """Ask until there is an answer; returns what is wrong, empty if nothing.

        The same loss asked about again is the same adaptation. It is asked for first without waiting for its end, so
        that it can be withdrawn by its id. The manager's own end may have interrupted one that is rolled back after a
        question without a reply. Then another one is asked for, once.
        """
        changes = tuple(Move(name, rescue.target) for name in components)
        key = f"lost-{rescue.loss}-{rescue.host}-{'-'.join(components)}"[:200]
        reason = f"host {rescue.host!r} is lost"
        request = AdaptationRequest(changes, reason, "the stack's rules for hosts", key=key, wait=False)
        deadline = time.monotonic() + KEEP_TRYING
        may_be_interrupted = False
        while not rescue.withdrawn or request.wait:
            try:
                report = client.call(ADAPT, request, AdaptationReport, ANSWER_TIMEOUT)
            except (CallFailed, BusError, SchemaError) as error:
                if _is_without_reply(error) and _is_there(client):
                    deadline = time.monotonic() + KEEP_TRYING  # it waits for its turn: others are being confirmed
                if time.monotonic() > deadline:
                    return f"{', '.join(components)}: {error}"
                may_be_interrupted = True
                request = replace(request, wait=False)
                time.sleep(RETRY_INTERVAL)
                continue
            if report.outcome is Outcome.PENDING:
                request, rescue.waiting = replace(request, wait=True), report.id
                if rescue.withdrawn:
                    _cancel_waiting(client, rescue.waiting)
                continue
            if report.outcome in APPLIED:
                return ""
            if report.outcome is Outcome.ROLLED_BACK and may_be_interrupted and request.key == key:
                request = replace(request, key=f"again-{key}"[:200], wait=False)
                continue
            told = [f"{v.component}: {v.problem}" for v in report.violations] or [report.error]
            return f"{', '.join(components)}: {report.outcome.value}: {'; '.join(told)}"
        return ""

    def _withdraw(self, rescue: _Rescue) -> None:
        with Client(self._bus, self._system, f"host-local-{rescue.loss}-back") as client:
            _cancel_waiting(client, rescue.waiting)


def _cancel_waiting(client: Client, adaptation: str) -> None:
    """Cancel an adaptation that still waits for its turn: the journal has a line of what has begun."""
    try:
        lines = client.call(JOURNAL, JournalRequest(), JournalPage, ANSWER_TIMEOUT).entries
        if adaptation and all(line.id != adaptation for line in lines):
            client.call(CANCEL, CancelAdaptation(adaptation), AdaptationReport, ANSWER_TIMEOUT)
    except (CallFailed, BusError, SchemaError):
        return  # a manager that has died keeps nothing that waited


def _is_without_reply(error: Exception) -> bool:
    return isinstance(error, CallFailed) and error.answer is None


def _is_there(client: Client) -> bool:
    """Return whether the manager answers questions."""
    try:
        client.call(JOURNAL, JournalRequest(limit=1), JournalPage, ANSWER_TIMEOUT)
    except (CallFailed, BusError, SchemaError):
        return False
    return True
