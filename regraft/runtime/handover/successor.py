"""The successor's part in a hand-over: get ready next to the incumbent, take over from it, or go live alone.

A frozen run can take over too: from its own successor, to which it had handed over before.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from regraft.bus.interface import Answer
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError
from regraft.bus_schema.messages.protocol.handover import HandedOver, Handover, HandoverOffer, HandoverStep, Role
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.bus_schema.texts import told
from regraft.component.component import Component, class_path
from regraft.patience import stretched
from regraft.runtime.core.assignment import Succession
from regraft.runtime.core.control_refusal import ControlRefused
from regraft.runtime.core.pending import Pending
from regraft.runtime.data.writers import Identity
from regraft.runtime.handover.incumbent import Incumbent
from regraft.runtime.handover.standby import Standby
from regraft.runtime.handover.transfer import Transfer
from regraft.runtime.lifecycle.answering import Answering
from regraft.runtime.lifecycle.connections import Connections
from regraft.runtime.lifecycle.lifecycle import Lifecycle, TransitionFailed
from regraft.runtime.parts import Parts

PREPARE_TIMEOUT = 2.0
PULL_TIMEOUT = 0.6
"""Seconds that the incumbent may take to answer, a ``pull`` from when its longest handler has ended."""
TAKE_OVER_TIMEOUT = 1.0
"""Seconds of wall-clock time that an answer to ``take_over`` is put off, beyond the longest handler."""


class Successor:
    """A run that may take over. ``problems`` keep it from that. ``incumbent`` is its own part as one."""

    def __init__(
        self,
        parts: Parts,
        lifecycle: Lifecycle,
        connections: Connections,
        transfer: Transfer,
        answering: Answering,
        standing: Standby,
        incumbent: Incumbent,
    ) -> None:
        self.problems: tuple[str, ...] = ()
        self._parts = parts
        self._lifecycle = lifecycle
        self._connections = connections
        self._transfer = transfer
        self._answering = answering
        self._standing = standing
        self._incumbent = incumbent
        self._offer: HandoverOffer | None = None
        self._attempt = 0
        self._outcome: dict[str, Any] | ControlRefused | None = None

    def stand_by(self) -> None:
        """Begin as a successor: returns when this run has become live, or is to end."""
        parts = self._parts
        self._standing.step_aside()
        parts.presence.listen_for_control()
        parts.presence.watch_hosts()
        parts.reporter.update(revision=parts.assignment.revision)
        ask = Handover(HandoverStep.PREPARE, parts.assignment.incarnation)
        self._ask(self._succession.incarnation, ask, PREPARE_TIMEOUT, self._prepared)
        self._standing.stand_still()

    @property
    def _succession(self) -> Succession:
        succession = self._parts.assignment.succeeds
        assert succession is not None, "only a successor waits"
        return succession

    def _ask(self, incarnation: int, ask: Handover, within: float, then: Callable[[list[Answer]], None]) -> None:
        parts = self._parts
        key = parts.keys.control(parts.assignment.name, incarnation, "handover")
        parts.bus.ask(key, codec.encode(ask), stretched(within), lambda answers: parts.post(lambda: then(answers)))

    def _prepared(self, answers: list[Answer]) -> None:
        """Get ready with what the incumbent has reported; the asker is notified of a failure."""
        parts = self._parts
        if self._standing.role is not Role.WAITING or self._offer is not None:
            return
        try:
            offer = self._offer = self._fitting(answers, with_state=self._succession.with_state)
            if offer.cls == class_path(type(parts.component)):
                self._transfer.take_parameters(offer.parameters)
            self._get_ready(offer.epoch)
            for key, encoding in offer.writes.items():
                if parts.keys.topic_of(key) is None:
                    parts.writers.open(key, encoding)
        except (ControlRefused, TransitionFailed) as error:
            self.problems = getattr(error, "problems", (str(error),))
        self._standing.show()

    def _fitting(self, answers: list[Answer], *, with_state: bool) -> HandoverOffer:
        """Return what the incumbent offers; raises ControlRefused if this run cannot continue from it."""
        offer: HandoverOffer = _answered(answers, HandoverOffer, "prepare")
        problems = self._transfer.misfits(offer, with_state=with_state)
        if problems:
            raise ControlRefused(ControlCode.REFUSED, *problems)
        self._transfer.set_clock(offer.now, offer.tick)
        return offer

    def _get_ready(self, epoch: int) -> None:
        parts = self._parts
        if type(parts.component).is_exclusive():
            self._connections.connect()  # and is configured when the incumbent has released its resources
        else:
            self._lifecycle.reach(State.INACTIVE)
        name, own = parts.assignment.name, parts.assignment.incarnation
        parts.reporter.get_ready(Identity(name, own, own))
        parts.requests.client = f"{name}-{epoch}"
        parts.presence.listen_for_replies()
        parts.presence.listen_for_requests()

    def take_over(self, asked: Handover) -> dict[str, object] | Pending:
        """Pull from the incumbent and go live; the answer comes then."""
        if self._standing.role is Role.LIVE:
            return {}
        if self._standing.role is Role.FROZEN:
            self.problems = ()  # those of another attempt
        elif self.problems:
            raise ControlRefused(ControlCode.REFUSED, *self.problems)
        self._outcome = None
        self._attempt += 1
        if self._standing.role is Role.FROZEN:
            self._take_back(asked)
        elif self._offer is None:
            raise ControlRefused(ControlCode.FAILED, "the incumbent has not handed over yet")
        else:
            self._pull(self._succession.incarnation, asked)
        cls = type(self._parts.component)
        longest = self._handler_timeout() + (self._parts.handler_timeout if cls.is_exclusive() else 0.0)
        at_most = round(stretched(TAKE_OVER_TIMEOUT + longest) * 1e9)
        return Pending(lambda: self._outcome is not None, self._tell_outcome, at_most)

    def _handler_timeout(self) -> float:
        return self._offer.handler_timeout if self._offer is not None else Component.handler_timeout

    def _pull(self, incumbent: int, asked: Handover) -> None:
        attempt, own = self._attempt, self._parts.assignment.incarnation
        self._standing.held.mark()
        with_state = self._standing.role is Role.FROZEN or self._succession.with_state
        first = self._standing.held.first
        pull = Handover(HandoverStep.PULL, own, first=first, term=asked.term, with_state=with_state)
        within = PULL_TIMEOUT + self._handler_timeout()
        self._ask(incumbent, pull, within, lambda answers: self._pulled(attempt, answers, asked))

    def _take_back(self, asked: Handover) -> None:
        """Take over, as another incarnation, from the run that this one had handed over to."""
        own = self._parts.assignment.incarnation
        if not asked.peer or asked.incarnation <= max(own, asked.peer):
            problem = "a frozen run takes over from a peer, as an incarnation higher than both"
            raise ControlRefused(ControlCode.REFUSED, problem)
        self._standing.become(asked.incarnation)
        self._standing.step_aside()
        attempt = self._attempt

        def offered(answers: list[Answer]) -> None:
            if attempt != self._attempt or self._standing.role is Role.LIVE:
                return
            try:
                self._offer = self._fitting(answers, with_state=True)
            except ControlRefused as error:
                self._outcome = error
                return
            self._pull(asked.peer, asked)

        self._ask(asked.peer, Handover(HandoverStep.PREPARE, asked.incarnation), PULL_TIMEOUT, offered)

    def _tell_outcome(self) -> dict[str, object]:
        outcome = self._outcome
        if outcome is None:
            self._attempt += 1
            raise ControlRefused(ControlCode.TIMED_OUT, "the take-over took too long")
        if isinstance(outcome, ControlRefused):
            raise outcome
        return outcome

    def _pulled(self, attempt: int, answers: list[Answer], asked: Handover) -> None:
        if attempt != self._attempt or self._standing.role is Role.LIVE:
            return
        try:
            handed = _answered(answers, HandedOver, "pull")
        except ControlRefused as error:
            self._outcome = error
            return
        self._go_live(lambda: self._take_in(handed), asked)

    def _take_in(self, handed: HandedOver) -> dict[str, object]:
        parts = self._parts
        with_state, returns = True, self._standing.role is Role.FROZEN
        if returns:
            self._incumbent.keep_own()
            self._standing.overhear(handed.writes)
            self._standing.end_former()  # and keep the previous values: the successor's went with it
        else:
            with_state = self._succession.with_state
            if self._offer is not None and self._offer.cls == class_path(type(parts.component)):
                self._transfer.take_parameters(handed.parameters)
        if parts.state is State.UNCONFIGURED:
            self._lifecycle.perform(Transition.CONFIGURE)
        silent = self._transfer.take_over(handed, self._standing.held, with_state=with_state)
        if returns:
            self._incumbent.forget_own()
        return {"silent": silent / 1e9, "left_over": len(handed.unhandled)}

    def _go_live(self, begin: Callable[[], dict[str, object]], asked: Handover) -> None:
        """Go live; a run that cannot is of no use any more, and reports why."""
        parts = self._parts
        try:
            outcome = begin()
        except Exception as error:
            parts.reporter.fault("taking over", error)
            self._standing.step_aside()
            refused = ControlRefused(ControlCode.FAILED, f"could not take over: {told(error)}")
            self.problems, self._outcome = refused.problems, refused
            return
        self._standing.be_live()
        self._answering.note_revision(asked.revision)
        self._outcome = outcome
        self._answering.answer_parked()

    def promote(self, asked: Handover) -> dict[str, object]:
        """Go live without an incumbent, which must be dead for certain; its state is lost."""
        if self._standing.role is Role.FROZEN:
            raise ControlRefused(ControlCode.REFUSED, "this run is frozen: it can resume or retire")
        if self._standing.role is Role.WAITING:
            self._attempt += 1
            self._go_live(self._go_alone, asked)
            self._tell_outcome()
        return {}

    def _go_alone(self) -> dict[str, object]:
        parts = self._parts
        own = parts.assignment.incarnation
        if self._offer is None or self.problems:
            self._lifecycle.reach(State.INACTIVE)
            parts.presence.listen_for_requests()
        self.problems = ()
        parts.requests.client = f"{parts.assignment.name}-{own}"
        parts.presence.listen_for_replies()
        self._transfer.speak(own)
        self._lifecycle.reach(parts.assignment.state)
        recent = self._standing.held.since_mark() if self._attempt > 1 else []
        self._standing.held.take_all()
        parts.handle(recent)
        return {}


def _answered(answers: list[Answer], kind: type[Any], what: str) -> Any:
    """Return what the incumbent has answered; raises ControlRefused."""
    if not answers:
        raise ControlRefused(ControlCode.TIMED_OUT, f"the incumbent did not answer {what!r} in time")
    (answer, *_) = answers
    try:
        if answer.error:
            error = codec.decode(answer.payload, ControlError)
            raise ControlRefused(error.code, *error.problems)
        return codec.decode(answer.payload, kind)
    except SchemaError as wrong:
        raise ControlRefused(ControlCode.FAILED, f"the incumbent's answer to {what!r} {wrong}") from None
