"""A tool's requests to services and actions (``regraft.bus_schema.messages.protocol.requests``), blocking."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

from regraft.bus.interface import BusError, Sample
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys, service_name
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.client.sending import Sender
from regraft.component.errors import CallFailed

A = TypeVar("A")
F = TypeVar("F")

ASK_INTERVAL = 1.0
"""Seconds of silence after which a request is repeated, under the same number."""


@dataclass(slots=True)
class Pending:
    """A request under way. ``heard_at`` is when something was last said about it, ``alone`` that nobody listens."""

    service: str
    request: Request
    read: Callable[[PlainValue], Any]
    read_feedback: Callable[[PlainValue], Any] | None
    on_feedback: Callable[[Any], object] | None
    heard_at: float
    accepted: threading.Event = field(default_factory=threading.Event)
    ended: threading.Event = field(default_factory=threading.Event)
    value: Any = None
    error: CallFailed | None = None
    latest: Any = None
    alone: bool = False

    def end(self, error: CallFailed | None, value: Any = None) -> None:
        """End it, well or not; the first end counts."""
        if not self.ended.is_set():
            self.error, self.value = error, value
            self.ended.set()
            self.accepted.set()


class ClientGoal(Generic[A, F]):
    """A goal that an action pursues for a tool."""

    def __init__(self, requests: Requests, pending: Pending) -> None:
        self._requests = requests
        self._pending = pending

    @property
    def done(self) -> bool:
        """Whether it has ended, well or not."""
        return self._pending.ended.is_set()

    @property
    def feedback(self) -> F | None:
        """The latest feedback, None before the first."""
        feedback: F | None = self._pending.latest
        return feedback

    def result(self, timeout: float) -> A:
        """Wait for the result.

        Raises:
            CallFailed: refused, failed, cancelled; or not ended after ``timeout`` seconds: the goal then goes on,
                and its result can be waited for again.
        """
        if not self._pending.ended.wait(timeout):
            raise CallFailed(self._pending.service, None, f"the goal is still being pursued after {timeout:g} s")
        value: A = self._requests.outcome(self._pending)
        return value

    def cancel(self) -> None:
        """Ask the action to end it; ``result`` then raises CallFailed with the answer ``cancelled``."""
        self._requests.cancel(self._pending)


class Requests:
    """All requests that one client has under way. Thread-safe."""

    def __init__(self, keys: Keys, client: str, sender: Sender) -> None:
        """Ask under the name ``client``, unique in the system."""
        self._keys = keys
        self._client = client
        self._sender = sender
        self._lock = threading.Lock()
        self._pending: dict[int, Pending] = {}
        self._number = 0
        self._closed = False

    def call(
        self,
        service: str,
        body: PlainValue,
        read: Callable[[PlainValue], A],
        timeout: float,
        *,
        patient: bool = False,
    ) -> A:
        """Ask a service and wait for its reply; ``patient``: and again when a refusal says so. Raises CallFailed.

        ``body`` is the request as plain data; ``read`` makes something of the reply's, or raises BadMessage.
        """
        until = time.monotonic() + timeout
        left = timeout
        while True:
            try:
                return self._call(service, body, read, left)
            except CallFailed as refused:
                left = until - time.monotonic() - (refused.retry_after or 0.0)
                if refused.retry_after is None or left <= 0.0 or not patient:
                    raise
                time.sleep(refused.retry_after)

    def _call(self, service: str, body: PlainValue, read: Callable[[PlainValue], A], timeout: float) -> A:
        pending = self._begin(Verb.CALL, service, body, read, timeout)
        if not pending.ended.wait(timeout):
            self._give_up(pending)
        value: A = self.outcome(pending)
        return value

    def goal(
        self,
        service: str,
        body: PlainValue,
        read: Callable[[PlainValue], A],
        read_feedback: Callable[[PlainValue], F] | None,
        *,
        on_feedback: Callable[[F], object] | None,
        accept_within: float,
        outlives: bool,
    ) -> ClientGoal[A, F]:
        """Give an action a goal as plain data and wait until it is taken up; raises CallFailed."""
        pending = self._begin(
            Verb.GOAL,
            service,
            body,
            read,
            accept_within,
            read_feedback=read_feedback,
            on_feedback=on_feedback,
            outlives=outlives,
        )
        if not pending.accepted.wait(accept_within):
            self._give_up(pending)
        if pending.error:
            raise pending.error
        return ClientGoal(self, pending)

    def outcome(self, pending: Pending) -> Any:
        """Return the value of an ended request; raises CallFailed."""
        if pending.error:
            raise pending.error
        return pending.value

    def cancel(self, pending: Pending) -> None:
        """Ask for the end of a goal."""
        if not pending.ended.is_set():
            self._send(pending, Verb.CANCEL)

    def _begin(
        self,
        verb: Verb,
        service: str,
        body: PlainValue,
        read: Callable[[PlainValue], Any],
        timeout: float,
        *,
        read_feedback: Callable[[PlainValue], Any] | None = None,
        on_feedback: Callable[[Any], object] | None = None,
        outlives: bool = False,
    ) -> Pending:
        service_name(service)
        with self._lock:
            if self._closed:
                raise CallFailed(service, None, "the client is closed")
            self._number += 1
            request = Request(self._client, self._number, verb, body, timeout, outlives)
            pending = Pending(service, request, read, read_feedback, on_feedback, time.monotonic())
            self._pending[self._number] = pending
        try:
            self._send(pending, verb)
        except BadMessage:
            with self._lock:
                del self._pending[pending.request.number]
            raise
        return pending

    def _send(self, pending: Pending, verb: Verb) -> None:
        body = pending.request.body if verb in (Verb.CALL, Verb.GOAL) else None
        request = replace(pending.request, verb=verb, body=body)
        try:
            self._sender.put(self._keys.request(pending.service), request)
        except BusError as error:
            self._end(pending, CallFailed(pending.service, None, str(error)))

    def reaches(self, service: str) -> bool:
        """Tell whether somebody hears what a service is asked; raises BusError."""
        return self._sender.reaches(self._keys.request(service), type_of(Request).encoding)

    def _give_up(self, pending: Pending) -> None:
        offered = self._sender.matched(self._keys.request(pending.service))
        patience = f"{pending.request.patience:g} s"
        why = f"no answer within {patience}" if offered else f"nobody offers this service (waited {patience})"
        self._end(pending, CallFailed(pending.service, None, why))

    def _end(self, pending: Pending, error: CallFailed | None, value: Any = None) -> None:
        with self._lock:
            self._pending.pop(pending.request.number, None)
        pending.end(error, value)

    def ask_again(self) -> None:
        """Repeat what has met with silence, or whose service has come back; called several times a second."""
        with self._lock:
            waiting = list(self._pending.values())
        for pending in waiting:
            now = time.monotonic()
            if self._has_come_back(pending) or now - pending.heard_at >= ASK_INTERVAL:
                pending.heard_at = now
                self._send(pending, Verb.RESULT if pending.accepted.is_set() else pending.request.verb)

    def _has_come_back(self, pending: Pending) -> bool:
        """Tell whether somebody offers a service again that nobody offered at the last look."""
        was_alone = pending.alone
        pending.alone = not self._sender.matched(self._keys.request(pending.service))
        return was_alone and not pending.alone

    def close(self) -> None:
        """End the wait of everybody who waits."""
        with self._lock:
            self._closed = True
            waiting = list(self._pending.values())
        for pending in waiting:
            self._end(pending, CallFailed(pending.service, None, "the client was closed"))

    # --- replies ---

    def take(self, sample: Sample) -> None:
        """Take a reply."""
        try:
            reply = codec.decode(sample.payload, Reply)
        except BadMessage:
            return
        with self._lock:
            pending = self._pending.get(reply.number)
        if pending is None:
            return
        pending.heard_at = time.monotonic()
        try:
            self._take(pending, reply)
        except BadMessage as error:
            why = f"sent a reply that does not fit: {error}"
            self._end(pending, CallFailed(pending.service, Answer.FAILED, why))

    def _take(self, pending: Pending, reply: Reply) -> None:
        if reply.answer is Answer.ACCEPTED:
            pending.accepted.set()
        elif reply.answer is Answer.FEEDBACK:
            if pending.read_feedback is not None:
                pending.latest = pending.read_feedback(reply.body)
                if pending.on_feedback:
                    pending.on_feedback(pending.latest)
        elif reply.answer is Answer.RESULT:
            self._end(pending, None, pending.read(reply.body))
        else:
            self._end(pending, CallFailed.by(pending.service, reply))
