"""The incumbent's part in a hand-over: freeze, hand over, and then resume or retire."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from bus_schema.encoding import codec
from bus_schema.messages.control import ControlCode
from bus_schema.messages.handover import HandedOver, Handover, HandoverOffer, Role
from bus_schema.model.lifecycle import State, Transition
from regraft.runtime import passing_on
from regraft.runtime.held import First
from regraft.runtime.lifecycle import TransitionFailed
from regraft.runtime.refusal import ControlRefused
from regraft.runtime.rewiring import Pending
from regraft.runtime.standing import Standing
from regraft.runtime.stream import Stream

if TYPE_CHECKING:
    from regraft.runtime.runtime import Runtime

CATCH_UP = 150_000_000
"""Nanoseconds of wall-clock time that an incumbent may take to handle what its successor does not hold."""
CATCH_UP_IN_STEP = 500_000_000
"""The same for what has to come first, in step: what has not come by then is not handed over."""
DRAIN = 0.1
"""Seconds that it then lets services and handlers under way finish."""
LOOK_EVERY = 0.001


class Incumbent:
    """A run that is succeeded. ``barred`` is the highest incarnation that was given up as its successor."""

    def __init__(self, runtime: Runtime, standing: Standing) -> None:
        """Not asked yet."""
        self._runtime = runtime
        self._standing = standing
        self._barred = 0
        self._frozen_at = 0
        self._let_go: HandedOver | None = None
        self._keeps_state = True

    def prepare(self, asked: Handover) -> HandoverOffer:
        """Say what would be handed over; nothing changes."""
        if self._standing.role is Role.WAITING:
            raise ControlRefused(ControlCode.REFUSED, "this run waits itself")
        return passing_on.offer(self._runtime)

    def pull(self, asked: Handover) -> Pending | bytes:
        """Freeze and hand over, to a successor that was not given up; asked again, hand over again."""
        self._refuse_barred(asked)
        if self._standing.role is Role.FROZEN:
            return codec.encode(self._handed_over(asked))
        if self._standing.role is Role.WAITING or self._runtime.state not in (State.ACTIVE, State.INACTIVE):
            how = self._standing.role.value if self._standing.role is Role.WAITING else self._runtime.state.value
            raise ControlRefused(ControlCode.REFUSED, f"this run is {how}: there is nothing to hand over")
        return Pending(
            lambda: self._has_caught_up(asked.first),
            lambda: self._freeze(asked),
            CATCH_UP_IN_STEP if self._runtime.stepped else CATCH_UP,
            self._standing.stand_still,
        )

    def _refuse_barred(self, asked: Handover) -> None:
        if asked.peer <= max(self._barred, self._runtime.assignment.incarnation):
            raise ControlRefused(ControlCode.REFUSED, f"incarnation {asked.peer} is no successor of this run any more")

    def _has_caught_up(self, first: First) -> bool:
        if self._runtime.stepped:
            return self._has_all(first)
        inbound = self._runtime.inbound
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
        """Tell whether all has come that the successor does not hold: in a slot nothing is handled, but handed over."""
        runtime = self._runtime
        for item in runtime.inbox.take_shelved():
            runtime.take(item)
        for key, sources in first.items():
            for source, place in sources.items():
                stream = runtime.inbound.streams.get((key, source))
                if stream is None or not stream.wired or stream.epoch > place.epoch:
                    continue
                if stream.epoch < place.epoch or not stream.reaches(place.sequence - 1):
                    return False
        return True

    def _freeze(self, asked: Handover) -> bytes:
        """Take no more messages, finish what is under way, and return what is handed over."""
        self._refuse_barred(asked)
        runtime = self._runtime
        if runtime.stepped and not self._has_all(asked.first):
            raise ControlRefused(ControlCode.FAILED, "some of the messages that this run was sent have not come yet")
        self._let_go, self._keeps_state = None, True
        self._frozen_at = runtime.clock.now()
        self._finish_answers()
        while (item := runtime.inbox.get(0.0)) is not None:
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
        if type(runtime.component).is_exclusive():
            self._let_go = self._for_itself(with_state=asked.with_state)
            runtime.lifecycle.let_go()
        return payload

    def _handed_over(self, asked: Handover) -> HandedOver:
        if self._let_go is not None:
            return self._let_go
        held, first = self._standing.held, asked.first
        return passing_on.hand_over(self._runtime, held, first, self._frozen_at, with_state=asked.with_state)

    def _for_itself(self, *, with_state: bool) -> HandedOver:
        """Return what this run goes on from, should it take hold again; without a state if it cannot give one.

        A successor that does without the state may be wanted just because of that.
        """
        runtime, held, since = self._runtime, self._standing.held, self._frozen_at
        try:
            return passing_on.hand_over(runtime, held, {}, since)
        except Exception as error:
            if with_state:
                raise
            runtime.herald.fault("snapshot", error)
            self._keeps_state = False
            return passing_on.hand_over(runtime, held, {}, since, with_state=False)

    def _finish_answers(self) -> None:
        """Let what was begun for a message or request finish: that takes replies and time, nothing else."""
        runtime = self._runtime
        if runtime.stepped:
            return  # in a slot there is neither
        until = time.monotonic() + DRAIN
        while any(task.answers for task in runtime.tasks.alive) and time.monotonic() < until:
            item = runtime.inbox.get(LOOK_EVERY)
            if item is not None:
                self._put_aside(item)
            runtime.timers.wake_sleepers(runtime.clock.now())
            runtime.work()

    def _put_aside(self, item: Any) -> None:
        runtime = self._runtime
        sample = runtime.bus.open_sample(item)
        if sample is None:
            if runtime.bus.open_query(item) is None and callable(item):
                item()
            else:
                self._standing.later.append(item)
        elif runtime.inbound.consumer_of(sample.key) is runtime.caller:
            runtime.inbound.arrive(sample)
        else:
            self._standing.keep_sample(sample)

    def resume(self, asked: Handover) -> dict[str, object]:
        """Speak for the component again, and handle all that has come meanwhile."""
        runtime = self._runtime
        self._barred = max(self._barred, asked.peer)
        if self._standing.role is Role.WAITING:
            raise ControlRefused(ControlCode.REFUSED, "this run waits: it can take over, be promoted or retire")
        if self._standing.role is Role.LIVE:
            return {}
        own = runtime.assignment.incarnation
        if asked.incarnation and asked.incarnation <= max(own, self._barred):
            problem = f"incarnation: is {asked.incarnation}, must be higher than {max(own, self._barred)}"
            raise ControlRefused(ControlCode.REFUSED, problem)
        if asked.incarnation:
            self._standing.become(asked.incarnation)
        failed = self._take_hold_again() if self._let_go is not None else None
        passing_on.speak(runtime, runtime.identity.epoch)
        self._standing.be_live()
        runtime.herald.beat()
        self._standing.go_on()
        runtime.control.note_revision(asked.revision)
        if failed is not None:
            raise ControlRefused(ControlCode.FAILED, f"{failed}; now {runtime.state.value}")
        return {}

    def _take_hold_again(self) -> Exception | None:
        """Go on from what this run itself had handed over before it let go; returns why it could not."""
        runtime, handed, self._let_go = self._runtime, self._let_go, None
        assert handed is not None, "only a run that has let go takes hold again"
        try:
            runtime.lifecycle.perform(Transition.CONFIGURE)
            passing_on.take_over(runtime, handed, self._standing.held, with_state=self._keeps_state)
        except Exception as error:
            runtime.herald.fault("resuming", error)
            return error
        return None

    def retire(self, _: Handover) -> Pending:
        """End a run that does not speak for its component."""
        if self._standing.role is Role.LIVE:
            raise ControlRefused(ControlCode.REFUSED, "this run speaks for the component: it is not to retire")
        return Pending(lambda: True, dict, afterwards=self.end)

    def end(self) -> None:
        """End, whatever the author's methods say to it."""
        try:
            self._runtime.lifecycle.reach(State.FINALIZED)
        except TransitionFailed:
            self._runtime.herald.say(state=State.FINALIZED)
