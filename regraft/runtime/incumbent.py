"""The incumbent's part in a hand-over: freeze, hand over, and then resume or retire."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from bus_schema import codec
from bus_schema.lifecycle import State
from bus_schema.messages.control import ControlCode
from bus_schema.messages.handover import Handover, HandoverOffer, Role
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

    def prepare(self, asked: Handover) -> HandoverOffer:
        """Say what would be handed over; nothing changes."""
        if self._standing.role is Role.WAITING:
            raise ControlRefused(ControlCode.REFUSED, "this run waits itself")
        return passing_on.offer(self._runtime)

    def pull(self, asked: Handover) -> Pending | bytes:
        """Freeze and hand over, to a successor that was not given up; asked again, hand over again."""
        self._refuse_barred(asked)
        if self._standing.role is Role.WAITING or self._runtime.state not in (State.ACTIVE, State.INACTIVE):
            how = self._standing.role.value if self._standing.role is Role.WAITING else self._runtime.state.value
            raise ControlRefused(ControlCode.REFUSED, f"this run is {how}: there is nothing to hand over")
        if self._standing.role is Role.FROZEN:
            return self._handed_over(asked)
        return Pending(
            lambda: self._has_caught_up(asked.first), lambda: self._freeze(asked), CATCH_UP, self._standing.stand_still
        )

    def _refuse_barred(self, asked: Handover) -> None:
        if asked.peer <= max(self._barred, self._runtime.assignment.incarnation):
            raise ControlRefused(ControlCode.REFUSED, f"incarnation {asked.peer} is no successor of this run any more")

    def _has_caught_up(self, first: First) -> bool:
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

    def _freeze(self, asked: Handover) -> bytes:
        """Take no more messages, finish what is under way, and return what is handed over."""
        self._refuse_barred(asked)
        runtime = self._runtime
        self._frozen_at = runtime.clock.now()
        self._finish_answers()
        while (item := runtime.inbox.get(0.0)) is not None:
            self._put_aside(item)
        try:
            handed = self._handed_over(asked)
        except Exception:
            self._standing.go_on()
            raise
        self._standing.role = Role.FROZEN
        self._standing.step_aside()
        self._standing.show()
        return handed

    def _handed_over(self, asked: Handover) -> bytes:
        handed = passing_on.hand_over(self._runtime, self._standing.held, asked.first, self._frozen_at)
        return codec.encode(handed)

    def _finish_answers(self) -> None:
        """Let what was begun for a message or request finish: that takes replies and time, nothing else."""
        runtime = self._runtime
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
        passing_on.speak(runtime, runtime.identity.epoch)
        self._standing.be_live()
        runtime.herald.beat()
        self._standing.go_on()
        runtime.control.note_revision(asked.revision)
        return {}

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
