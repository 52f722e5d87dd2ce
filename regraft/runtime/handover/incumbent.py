"""The incumbent's part in a hand-over: freeze, hand over, and then resume or retire."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.control import ControlCode
from regraft.bus_schema.messages.protocol.handover import HandedOver, Handover, HandoverOffer, Role
from regraft.bus_schema.model.lifecycle import State
from regraft.runtime.core.control_refusal import ControlRefused
from regraft.runtime.core.pending import Pending
from regraft.runtime.data.replay_buffer import First
from regraft.runtime.data.stream import Stream
from regraft.runtime.handover.standby import Standby
from regraft.runtime.handover.transfer import Transfer
from regraft.runtime.lifecycle.answering import Answering
from regraft.runtime.lifecycle.lifecycle import Lifecycle, TransitionFailed
from regraft.runtime.parts import Parts

CATCH_UP = 150_000_000
"""Nanoseconds of wall-clock time that an incumbent may take to handle what its successor does not hold."""
CATCH_UP_IN_STEP = 500_000_000
"""The same for what has to come first, in step: what has not come by then is not handed over."""
DRAIN = 0.1
"""Seconds that it then lets services and handlers under way finish."""
LOOK_INTERVAL = 0.001


class Incumbent:
    """A run that is succeeded. ``barred`` is the highest incarnation that was given up as its successor."""

    def __init__(
        self,
        parts: Parts,
        lifecycle: Lifecycle,
        transfer: Transfer,
        answering: Answering,
        standing: Standby,
        take: Callable[[Any], None],
    ) -> None:
        self._parts = parts
        self._lifecycle = lifecycle
        self._transfer = transfer
        self._answering = answering
        self._take = take
        self._standing = standing
        self._barred = 0
        self._frozen_at = 0
        self._own: HandedOver | None = None
        self._keeps_state = True

    def prepare(self, asked: Handover) -> HandoverOffer:
        """Report what would be handed over; nothing changes."""
        if self._standing.role is Role.WAITING:
            raise ControlRefused(ControlCode.REFUSED, "this run waits itself")
        return self._transfer.offer()

    def pull(self, asked: Handover) -> Pending | bytes:
        """Freeze and hand over, to a successor that was not given up; asked again, hand over again."""
        self._refuse_barred(asked)
        if self._standing.role is Role.FROZEN:
            return codec.encode(self._handed_over(asked))
        if self._standing.role is Role.WAITING or self._parts.state not in (State.ACTIVE, State.INACTIVE):
            how = self._standing.role.value if self._standing.role is Role.WAITING else self._parts.state.value
            raise ControlRefused(ControlCode.REFUSED, f"this run is {how}: there is nothing to hand over")
        return Pending(
            lambda: self._has_caught_up(asked.first),
            lambda: self._freeze(asked),
            CATCH_UP_IN_STEP if self._parts.stepped else CATCH_UP,
            self._standing.stand_still,
        )

    def _refuse_barred(self, asked: Handover) -> None:
        if asked.peer <= max(self._barred, self._parts.assignment.incarnation):
            raise ControlRefused(ControlCode.REFUSED, f"incarnation {asked.peer} is no successor of this run any more")

    def _has_caught_up(self, first: First) -> bool:
        if self._parts.stepped:
            return self._has_all(first)
        inbound = self._parts.inbound
        for key, sources in first.items():
            if inbound.consumer_of(key) is None:
                continue
            for source, place in sources.items():
                stream = inbound.streams.get((key, source), Stream())
                behind = (stream.epoch, stream.handled or 0) < (place.epoch, place.sequence - 1)
                if behind and place.sequence > 1:
                    return False
        return True

    def _has_all(self, first: First) -> bool:
        """Return whether all has come that the successor lacks: in a slot nothing is handled, but handed over."""
        parts = self._parts
        for item in parts.inbox.take_lazy():
            self._take(item)
        for key, sources in first.items():
            for source, place in sources.items():
                stream = parts.inbound.streams.get((key, source))
                if stream is None or not stream.wired or stream.epoch > place.epoch:
                    continue
                if stream.epoch < place.epoch or not stream.reaches(place.sequence - 1):
                    return False
        return True

    def _freeze(self, asked: Handover) -> bytes:
        """Take no more messages, finish what is under way, and return what is handed over."""
        self._refuse_barred(asked)
        parts = self._parts
        if parts.stepped and not self._has_all(asked.first):
            raise ControlRefused(ControlCode.FAILED, "some of the messages that this run was sent have not come yet")
        self._own, self._keeps_state = None, True
        self._frozen_at = parts.clock.now()
        self._finish_answers()
        while (item := parts.inbox.get(0.0)) is not None:
            self._put_aside(item)
        try:
            handed = self._handed_over(asked)
            payload = codec.encode(handed)
        except Exception:
            self._standing.go_on()
            raise
        self._standing.role = Role.FROZEN
        self._standing.step_aside()
        self._standing.show()
        if type(parts.component).is_exclusive():
            self.keep_own(with_state=asked.with_state)
            self._lifecycle.let_go()
        return payload

    def _handed_over(self, asked: Handover) -> HandedOver:
        if self._own is not None:
            return self._own
        held, first = self._standing.held, asked.first
        return self._transfer.hand_over(held, first, self._frozen_at, with_state=asked.with_state)

    def keep_own(self, *, with_state: bool = False) -> None:
        """Keep what this frozen run continues from, should it resume; without a state if it cannot give one.

        To be called before its state changes: it releases its resources, or takes another state in. A successor that
        does without the state may be wanted just because this run cannot give one.
        """
        if self._own is not None:
            return
        parts, held, since = self._parts, self._standing.held, self._frozen_at
        try:
            self._own = self._transfer.hand_over(held, {}, since)
        except Exception as error:
            if with_state:
                raise
            parts.reporter.fault("snapshot", error)
            self._keeps_state = False
            self._own = self._transfer.hand_over(held, {}, since, with_state=False)

    def forget_own(self) -> None:
        """Forget what this run had when it was frozen: it has taken over from its successor."""
        self._own = None
        self._standing.forget_overheard()

    def _finish_answers(self) -> None:
        """Let what was begun for a message or request finish: that takes replies and time, nothing else."""
        parts = self._parts
        if parts.stepped:
            return  # in a slot there is neither
        until = time.monotonic() + DRAIN
        while any(task.answers for task in parts.tasks.alive) and time.monotonic() < until:
            item = parts.inbox.get(LOOK_INTERVAL)
            if item is not None:
                self._put_aside(item)
            parts.timers.wake_sleepers(parts.clock.now())
            parts.work()

    def _put_aside(self, item: Any) -> None:
        parts = self._parts
        sample = parts.bus.open_sample(item)
        if sample is None:
            if parts.bus.open_query(item) is None and callable(item):
                item()
            else:
                self._standing.later.append(item)
        elif parts.inbound.consumer_of(sample.key) is parts.requests:
            parts.inbound.arrive(sample)
        else:
            self._standing.keep_sample(sample)

    def resume(self, asked: Handover) -> dict[str, object]:
        """Speak for the component again, and handle all that has come meanwhile."""
        parts = self._parts
        self._barred = max(self._barred, asked.peer)
        if self._standing.role is Role.WAITING:
            raise ControlRefused(ControlCode.REFUSED, "this run waits: it can take over, be promoted or retire")
        if self._standing.role is Role.LIVE:
            return {}
        own = parts.assignment.incarnation
        if asked.incarnation and asked.incarnation <= max(own, self._barred):
            problem = f"incarnation: is {asked.incarnation}, must be higher than {max(own, self._barred)}"
            raise ControlRefused(ControlCode.REFUSED, problem)
        if asked.incarnation:
            self._standing.become(asked.incarnation)
        failed = self._continue_from(self._own) if self._own is not None else None
        self._transfer.speak(parts.identity.epoch)
        self._standing.be_live()
        parts.reporter.beat()
        self._standing.go_on()
        self._answering.note_revision(asked.revision)
        if failed is not None:
            raise ControlRefused(ControlCode.FAILED, f"{failed}; now {parts.state.value}")
        return {}

    def _continue_from(self, own: HandedOver) -> Exception | None:
        """Continue from what this run itself had when it was frozen; returns why it could not."""
        self._own = None
        self._parts.writers.go_back_to(own.writes)
        try:
            self._lifecycle.reach(State.INACTIVE)
            self._transfer.take_over(own, self._standing.held, with_state=self._keeps_state)
        except Exception as error:
            self._parts.reporter.fault("resuming", error)
            return error
        return None

    def retire(self, _: Handover) -> Pending:
        """End a run that does not speak for its component."""
        if self._standing.role is Role.LIVE:
            raise ControlRefused(ControlCode.REFUSED, "this run speaks for the component: it is not to retire")
        return Pending(lambda: True, dict, afterwards=self.end)

    def end(self) -> None:
        """End, even if the author's methods raise."""
        try:
            self._lifecycle.reach(State.FINALIZED)
        except TransitionFailed:
            self._parts.reporter.update(state=State.FINALIZED)
