"""The requests of a component: futures, under the component's clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TypeVar

from regraft.bus.interface import Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.requests import Request, Verb
from regraft.bus_schema.model.robots.scopes import in_scope
from regraft.component.errors import CallFailed
from regraft.component.future import Future
from regraft.component.goal import Goal
from regraft.request_protocol import ASK_INTERVAL, PendingRequest, RequestProtocol, reader
from regraft.runtime.core.timers import Timers
from regraft.runtime.data.inputs import Reporter
from regraft.runtime.data.writers import Writer, Writers
from regraft.runtime.requests.first_wait import FirstWait

A = TypeVar("A")
F = TypeVar("F")

WAIT_FOR_SERVER = 0.2
"""Seconds that the first request at a service waits for its server's subscription."""


class RequestClient(RequestProtocol):
    """All requests that one component has under way; a consumer of their replies."""

    reliable = True
    paused = False
    wakes = True

    def __init__(
        self, keys: Keys, client: str, writers: Writers, timers: Timers, reporter: Reporter, scope: str = ""
    ) -> None:
        """Ask under the name ``client``, unique in the system; names of services are those of ``scope``."""
        super().__init__(client)
        self._keys = keys
        self._scope = scope
        self._writers = writers
        self._clock = writers.clock
        self._timers = timers
        self._reporter = reporter
        self._first_wait = FirstWait(WAIT_FOR_SERVER)

    def go_on_from(self, number: int) -> None:
        """Number further requests from behind ``number``: up to there, others were made in this client's name."""
        self.asked = max(self.asked, number)

    def call(self, service: str, request: object, reply: type[A], timeout: float) -> Future[A]:
        """Ask a service; returns the future of its reply, which is CallFailed after ``timeout`` seconds."""
        now = self._clock.now()
        deadline = now + round(timeout * 1e9)
        service = in_scope(self._scope, service)
        pending = self.begin(Verb.CALL, service, codec.to_plain(request), timeout, now, reader(reply))
        self._watch(pending, deadline)
        return pending.outcome

    def goal(
        self,
        service: str,
        goal: object,
        result: type[A],
        feedback: type[F] | None = None,
        accept_within: float = 5.0,
        on_feedback: Callable[[F], None] | None = None,
        *,
        outlives: bool = False,
    ) -> Goal[A, F]:
        """Give an action a goal; it fails if nobody accepts it in time."""

        def heard(message: F) -> None:
            given.feedback = message
            if on_feedback:
                on_feedback(message)

        now, plain, read = self._clock.now(), codec.to_plain(goal), reader(result)
        deadline = now + round(accept_within * 1e9)  # before the goal is given: a time that is none raises here
        read_feedback = reader(feedback) if feedback is not None else None
        service = in_scope(self._scope, service)
        pending = self.begin(
            Verb.GOAL, service, plain, accept_within, now, read, read_feedback, heard, outlives=outlives
        )
        given: Goal[A, F] = Goal(pending.outcome, pending.accepted, lambda: self.cancel(pending))
        self._watch(pending, deadline)
        return given

    @property
    def given(self) -> dict[str, tuple[int, ...]]:
        """The numbers of the goals under way that end with this run, by service."""
        found: dict[str, tuple[int, ...]] = {}
        for pending in self.under_way():
            if pending.request.verb is Verb.GOAL and not pending.request.outlives:
                found[pending.service] = (*found.get(pending.service, ()), pending.request.number)
        return found

    def cancel_given(self, goals: Mapping[str, Iterable[int]]) -> None:
        """Cancel the goals that the run before had given, by service: here nobody waits for them."""
        for service, numbers in goals.items():
            for number in numbers:
                self._put(service, Request(self.client, number, Verb.CANCEL))

    def send(self, pending: PendingRequest, request: Request) -> None:
        """Put a request; the first one at a service waits a moment for somebody who offers it."""
        self._put(pending.service, request)

    def _put(self, service: str, request: Request) -> None:
        writer = self._writer(service)
        self._first_wait.wait(writer)
        writer.put(codec.encode(request))

    def _writer(self, service: str) -> Writer:
        return self._writers.open(self._keys.request(service), type_of(Request).encoding)

    def cancel_all(self) -> None:
        """End every goal under way that does not outlive this run, and forget all requests."""
        for pending in self.under_way():
            if pending.request.verb is Verb.GOAL and not pending.request.outlives:
                self.cancel(pending)
            self.end(pending, CallFailed(pending.service, None, "the client stopped waiting"))

    # --- silence: ask again, and give up at the deadline ---

    def _watch(self, pending: PendingRequest, deadline: int) -> None:
        then = pending.heard_at + ASK_INTERVAL
        if not pending.accepted.done:
            then = min(then, deadline)
        self._timers.sleep_until(then).when_done(lambda: self._look(pending, deadline))

    def _look(self, pending: PendingRequest, deadline: int) -> None:
        if pending.outcome.done:
            return
        now = self._clock.now()
        if now >= deadline and not pending.accepted.done:
            self.give_up(pending, offered=self._writer(pending.service).matched)
            return
        # In lockstep it would depend on the machine when a service is seen to be offered.
        offered = None if self._writers.lockstep else self._writer(pending.service).matched
        self.repeat_if_silent(pending, now, offered=offered)
        self._watch(pending, deadline)

    # --- as a consumer of replies ---

    def deliver(self, sample: Sample) -> None:
        """Take a reply in its turn."""
        problem = self.take(sample.payload, self._clock.now())
        if problem is not None:
            self.refuse(Envelope.from_bytes(sample.attachment).source, problem)

    def refuse(self, source: str, why: str) -> None:
        """Count and report a reply that cannot be handled."""
        self._reporter.refused("reply", source, why)

    def report_lost(self, source: str, count: int) -> None:
        """Count and report replies that never came."""
        self._reporter.lost("replies", source, count)
