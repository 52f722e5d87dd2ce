"""A component's reports about itself: status and heartbeat, events, diagnostics, and faults, each once."""

from __future__ import annotations

import copy
import logging
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from regraft.bus.interface import Bus, BusError
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import MessageType, type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.health import ComponentStatus, Diagnostic, Event, Level
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.management.system import SystemFaultKind
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.texts import encodable, told
from regraft.runtime.core.clock import Clock
from regraft.runtime.data.own_news import OwnNews
from regraft.runtime.data.writers import Identity, Writers

REPEAT_INTERVAL = 5.0
"""Seconds before the same complaint is made again."""
SOON = 0.005
"""Seconds until what nobody waits for is reported."""


class StatusReporter:
    """Speaks for one component. Its reports are for onlookers and take no part in simulated time.

    Attributes:
        on_fault: called with the text of every fault, also of one that was an event moments ago.
    """

    def __init__(self, bus: Bus, keys: Keys, clock: Clock, identity: Identity, heartbeat: float) -> None:
        """Report nothing yet; ``heartbeat`` is in seconds."""
        self.log = logging.getLogger(identity.name)
        self.status = ComponentStatus(identity.name, identity.incarnation, State.UNCONFIGURED, 0, 0.0)
        self._clock = clock
        self._heartbeat = heartbeat
        self._keys = keys
        self._writers = Writers(bus, clock, identity)
        self._voices = {identity: self._writers}
        self._status_key = keys.status(identity.name)
        self._said: dict[tuple[str, str], float] = {}
        self.faults = 0
        self.on_fault: Callable[[str], None] = lambda text: None
        self.news: OwnNews | None = None
        self.next_beat = 0.0

    def update(self, **changes: Any) -> None:
        """Change the status and put it; raises BadMessage for what no status can hold, which changes nothing.

        Each heartbeat encodes the status again, outside of any handler. So it holds copies of what has been encoded.
        """
        status = replace(self.status, **changes, stamp=self._seconds())
        payload = codec.encode(status)
        if "values" in changes:
            status = replace(status, values=copy.deepcopy(status.values))
        self._beat(status, payload)

    def beat(self) -> None:
        """Put the status; it is the heartbeat too."""
        status = replace(self.status, stamp=self._seconds())
        self._beat(status, codec.encode(status))

    def _beat(self, status: ComponentStatus, payload: bytes) -> None:
        self.next_beat = time.monotonic() + self._heartbeat
        self.status = status
        self.put(self._status_key, type_of(ComponentStatus), payload)

    def beat_soon(self) -> None:
        """Put the status in a moment: until then the processor is theirs who wait for an answer."""
        self.next_beat = min(self.next_beat, time.monotonic() + SOON)

    def speak_as(self, identity: Identity, *, standby: bool = False) -> None:
        """Speak as ``identity`` from now on, at the standby key if ``standby``.

        The numbering is the run's own: its reports do not continue those of the run before it.
        """
        self._writers = self._voices.setdefault(identity, Writers(self._writers.bus, self._clock, identity))
        self.status = replace(self.status, incarnation=identity.incarnation)
        name = self.status.component
        self._status_key = self._keys.standby(name) if standby else self._keys.status(name)

    def get_ready(self, identity: Identity) -> None:
        """Declare what is reported first when this speaks as ``identity``: then it is reported without delay."""
        writers = self._voices.setdefault(identity, Writers(self._writers.bus, self._clock, identity))
        for key, kind in ((self._keys.status(identity.name), ComponentStatus), (self._keys.event, Event)):
            writers.open(key, type_of(kind).encoding)

    def beat_if_due(self) -> float:
        """Put the heartbeat if it is time; returns the seconds until the next."""
        left = self.next_beat - time.monotonic()
        if left <= 0:
            self.beat()
            return self._heartbeat
        return left

    def event(self, kind: str, text: str, **details: Any) -> None:
        """Report something that happened."""
        self.log.info("%s: %s", kind, text)
        self._put(self._keys.event, Event(self._seconds(), kind, self.status.component, text, details))

    def diagnose(self, subject: str, level: Level, text: str, **values: Any) -> None:
        """Put a diagnostic.

        In simulated time it is encoded again at the end of the step, or for a later reader. So it then has a copy.
        """
        diagnostic = Diagnostic(self._seconds(), self.status.component, subject, level, text, values)
        self._put(self._keys.diagnostics, diagnostic)
        if self.news is not None:
            self.news.diagnostic(replace(diagnostic, values=copy.deepcopy(values)))

    def quality(self, quality: Quality) -> None:
        """Put how a quality requirement is met."""
        self._put(self._keys.quality(quality.requirement), quality)
        if self.news is not None:
            self.news.quality(quality)

    def measured(self, qualities: MeasuredQualities) -> None:
        """Put the component's own qualities."""
        self._put(self._keys.qualities(qualities.component), qualities)
        if self.news is not None:
            self.news.measured(qualities)

    def forget_measured(self) -> None:
        """Have a reader that comes now hear nothing of what was measured before."""
        if self.news is not None:
            self.news.measured(None)

    def fault(self, where: str, error: BaseException) -> None:
        """Report an exception from an author's method, with its traceback in the log."""
        text = encodable(f"{where}: {told(error)}")
        self.on_fault(text)
        if self._fresh("fault", where + type(error).__name__):
            self.log.error(text, exc_info=error)
            self.event("component.fault", text)
        self.faults += 1
        self._note(SystemFaultKind.RAISED, text, type(error).__name__)
        self.status = replace(self.status, error=text[:2000])

    def failed(self, code: str, why: str, state: State) -> None:
        """Report that the component has left its state by itself, for ``state``, and ``why``."""
        why = encodable(why)
        self.update(state=state, failure=why[:2000])
        self._note(SystemFaultKind.FAILED, why, code)
        self.event("component.failed", f"{why[:1900]}; now {state.value}", code=code, state=state.value)

    def recovered(self, code: str, text: str) -> None:
        """Report that a failure is over, if there was one."""
        failure = self.status.failure
        if failure:
            self.update(failure="")
            self._note(SystemFaultKind.RECOVERED, f"{text}: {failure}", code)
            self.event("component.recovered", f"{text}: {failure[:1900]}", code=code)

    def refused(self, where: str, source: str, why: str) -> None:
        """Report a message that cannot be handled."""
        self.status = replace(self.status, refused=self.status.refused + 1)
        if self._fresh(where, source):
            self.event("message.refused", f"{where}, from {source or 'somebody without an envelope'}: {why}"[:2000])

    def lost(self, where: str, source: str, count: int) -> None:
        """Report messages that never came."""
        self.status = replace(self.status, lost=self.status.lost + count)
        if self._fresh("lost" + where, source):
            self.event("message.lost", f"{where}: {count} from {source}", count=count)

    def overrun(self, where: str, *, messages: int = 0) -> None:
        """Report that a call was left out, with so many ``messages``: too many of its kind are under way."""
        self.status = replace(self.status, lost=self.status.lost + messages)
        if self._fresh("overrun", where):
            text = f"{where}: too many of its calls are under way, so new ones are left out"
            self.event("handler.overrun", text)

    def _note(self, kind: SystemFaultKind, text: str, code: str) -> None:
        if self.news is not None:
            self.news.fault(self.status, self._seconds(), kind, text[:2000], code)

    def _fresh(self, what: str, who: str) -> bool:
        now = time.monotonic()
        if now - self._said.get((what, who), -REPEAT_INTERVAL) < REPEAT_INTERVAL:
            return False
        if len(self._said) > 1000:
            self._said.clear()
        self._said[what, who] = now
        return True

    def _put(self, key: str, message: object) -> None:
        self.put(key, type_of(type(message)), codec.encode(message))

    def put(self, key: str, kind: MessageType, payload: bytes) -> None:
        """Put a payload next to simulated time; a bus that is gone is no reason to fail."""
        try:
            self._writers.open(key, kind.encoding).put(payload)
        except BusError as error:
            self.log.warning("%s", error)

    def _seconds(self) -> float:
        return self._clock.now() / 1e9

    def close(self) -> None:
        """Stop reporting."""
        for writers in self._voices.values():
            writers.close_all()
