"""A tool's requests to services and actions: blocking, from any thread."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from regraft.bus.interface import BusError, Sample
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.requests import Request, Verb
from regraft.client.sending import Sender
from regraft.component.errors import CallFailed
from regraft.request_protocol import ASK_INTERVAL, PendingRequest, RequestProtocol

A = TypeVar("A")
F = TypeVar("F")


class ClientGoal(Generic[A, F]):
    """A goal that an action pursues for a tool."""

    def __init__(self, requests: Requests, pending: PendingRequest) -> None:
        self._requests = requests
        self._pending = pending
        self._ended = threading.Event()
        pending.outcome.when_done(self._ended.set)

    @property
    def done(self) -> bool:
        """Whether it has ended, well or not."""
        return self._pending.outcome.done

    @property
    def feedback(self) -> F | None:
        """The latest feedback, None before the first."""
        feedback: F | None = self._pending.feedback
        return feedback

    def result(self, timeout: float) -> A:
        """Wait for the result.

        Raises:
            CallFailed: refused, failed, cancelled; or not ended after ``timeout`` seconds: the goal is still
                pursued then, and its result can be waited for again.
        """
        if not self._ended.wait(timeout):
            raise CallFailed(self._pending.service, None, f"the goal is still being pursued after {timeout:g} s")
        value: A = _outcome(self._pending)
        return value

    def cancel(self) -> None:
        """Ask the action to end it; ``result`` then raises CallFailed with the answer ``cancelled``."""
        self._requests.cancel(self._pending)


def never() -> bool:
    """Return that a system has not ended, for who cannot know."""
    return False


class Requests(RequestProtocol):
    """All requests that one client has under way. Thread-safe."""

    def __init__(self, keys: Keys, client: str, sender: Sender, has_ended: Callable[[], bool]) -> None:
        """Ask under the name ``client``, unique in the system, until that ``has_ended``: looked at in silence."""
        super().__init__(client)
        self._keys = keys
        self._sender = sender
        self._has_ended = has_ended

    def call(
        self,
        service: str,
        body: PlainValue,
        read: Callable[[PlainValue], A],
        timeout: float,
        *,
        patient: bool = False,
    ) -> A:
        """Ask a service and wait for its reply; ``patient``: and again at a refusal's time to retry. Raises CallFailed.

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
        pending = self.begin(Verb.CALL, service, body, timeout, time.monotonic_ns(), read)
        ended = threading.Event()
        pending.outcome.when_done(ended.set)
        self._wait(pending, ended, timeout)
        value: A = _outcome(pending)
        return value

    def goal(
        self,
        service: str,
        body: PlainValue,
        read: Callable[[PlainValue], A],
        read_feedback: Callable[[PlainValue], F] | None,
        on_feedback: Callable[[F], object] | None,
        accept_within: float,
        *,
        outlives: bool,
    ) -> ClientGoal[A, F]:
        """Give an action a goal as plain data and wait until it is taken up; raises CallFailed."""
        now = time.monotonic_ns()
        pending = self.begin(
            Verb.GOAL, service, body, accept_within, now, read, read_feedback, on_feedback, outlives=outlives
        )
        settled = threading.Event()
        pending.accepted.when_done(settled.set)
        pending.outcome.when_done(settled.set)
        self._wait(pending, settled, accept_within)
        if pending.outcome.error is not None:
            raise pending.outcome.error
        return ClientGoal(self, pending)

    def _wait(self, pending: PendingRequest, event: threading.Event, timeout: float) -> None:
        if not event.wait(timeout):
            self.give_up(pending, offered=self._is_offered(pending))
            event.wait()  # a reply may have ended it at the same moment, and is about to set it

    def send(self, pending: PendingRequest, request: Request) -> None:
        """Put a request; end it if the bus cannot."""
        try:
            self._sender.put(self._keys.request(pending.service), request)
        except BusError as error:
            self.end(pending, CallFailed(pending.service, None, str(error)))

    def reaches(self, service: str) -> bool:
        """Return whether a subscriber gets requests to a service; raises BusError."""
        return self._sender.reaches(self._keys.request(service), type_of(Request).encoding)

    def _is_offered(self, pending: PendingRequest) -> bool:
        return self._sender.matched(self._keys.request(pending.service))

    def ask_again(self) -> None:
        """Repeat what has met with silence, or whose service has come back; called several times a second.

        All end once the system has: nobody is left who would answer.
        """
        now, under_way = time.monotonic_ns(), self.under_way()
        is_silent = any(now - pending.heard_at >= ASK_INTERVAL for pending in under_way)
        is_over = is_silent and self._has_ended()
        for pending in under_way:
            if is_over:
                self.end(pending, CallFailed(pending.service, None, "the system has ended"))
            else:
                self.repeat_if_silent(pending, time.monotonic_ns(), offered=self._is_offered(pending))

    def deliver(self, sample: Sample) -> None:
        """Take a reply; one that does not fit ends its request."""
        self.take(sample.payload, time.monotonic_ns())


def _outcome(pending: PendingRequest) -> Any:
    """Return the value of an ended request; raises CallFailed."""
    if pending.outcome.error is not None:
        raise pending.outcome.error
    return pending.outcome.value
