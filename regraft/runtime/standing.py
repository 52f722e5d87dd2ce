"""A run that does not speak for its component: it keeps what arrives, answers control queries, keeps its heartbeat."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bus_schema.messages.handover import Role
from bus_schema.model.lifecycle import State, Transition
from regraft.bus import Closable, Sample
from regraft.runtime import passing_on
from regraft.runtime.held import Held, envelope_of
from regraft.runtime.stream import Stream
from regraft.runtime.writers import Identity

if TYPE_CHECKING:
    from regraft.runtime.runtime import Runtime


NUMBERS_LEFT_OUT = 1_000_000
"""Numbers of requests that a run leaves out with a new incarnation: its successor may have used some in its name."""


class Standing:
    """A run's role, and what it does while that is not to be live."""

    def __init__(self, runtime: Runtime) -> None:
        """Be live, or wait if the assignment names a run to succeed."""
        self.role = Role.LIVE if runtime.assignment.succeeds is None else Role.WAITING
        self.held = Held()
        self.later: list[Any] = []
        self._runtime = runtime
        self._overheard: dict[str, int] = {}
        self._listening: list[Closable] = []
        self._token: Closable | None = None

    def stand_still(self) -> None:
        """Keep what arrives, answer control queries, keep the heartbeat; until this run is live, or is to end."""
        runtime = self._runtime
        if self.role is Role.FROZEN:
            self._listen_to_successor()
        later, self.later = self.later, []
        for item in later:
            runtime.take(item)
        while self.role is not Role.LIVE and runtime.state is not State.FINALIZED:
            runtime.control.answer_parked()
            wait, parked = runtime.herald.beat_if_due(), runtime.control.seconds_to_next()
            item = runtime.inbox.get(wait if parked is None else min(wait, parked))
            if item is not None:
                self._keep(item)

    def _keep(self, item: Any) -> None:
        """Take one item: samples are kept, everything else is answered or done."""
        sample = self._runtime.bus.open_sample(item)
        if sample is None:
            self._runtime.take(item)
        else:
            self.keep_sample(sample)

    def keep_sample(self, sample: Sample) -> None:
        """Keep a sample, and note what it says by itself."""
        runtime = self._runtime
        envelope = envelope_of(sample)
        if envelope is not None:
            if not sample.payload:
                seen = Stream(envelope.epoch, envelope.incarnation, envelope.sequence)
                runtime.rewiring.saw_marker(sample.key, envelope.source, seen)
            elif envelope.source == runtime.assignment.name and envelope.epoch == runtime.identity.epoch:
                self._overheard[sample.key] = max(envelope.sequence, self._overheard.get(sample.key, 0))
        if runtime.inbound.consumer_of(sample.key) is not None:
            self.held.add(sample, envelope)

    def _listen_to_successor(self) -> None:
        """Hear how far the successor numbers what it writes in this component's name."""
        runtime = self._runtime
        self._listening = [runtime.bus.subscribe(key, runtime.inbox.put) for key in runtime.writers.open_keys]

    def step_aside(self) -> None:
        """Speak for the component no more, but beside it."""
        assignment = self._runtime.assignment
        aside = Identity(f"{assignment.name}+", assignment.incarnation, assignment.incarnation)
        self._runtime.writers.speak_as(aside, mute=True)
        self._runtime.herald.speak_as(aside, standby=True)

    def show(self) -> None:
        """Have the token seen of a run that stands by."""
        assignment = self._runtime.assignment
        if self._token is None:
            key = self._runtime.keys.standby(assignment.name, assignment.incarnation)
            self._token = self._runtime.bus.announce(key)

    def be_live(self) -> None:
        """Speak for the component from now on."""
        self.role = Role.LIVE
        self._runtime.appear()
        self.leave()

    def go_on(self) -> None:
        """Handle what was kept, and what was put off; number on from what was overheard."""
        runtime = self._runtime
        passing_on.handle(runtime, self.held.take_all())
        later, self.later = self.later, []
        for item in later:
            runtime.inbox.put(item)
        overheard, self._overheard = self._overheard, {}
        numbering = runtime.writers.numbering()
        # What the successor said counts, but nobody has acknowledged it.
        runtime.writers.advanced |= {key: n for key, n in overheard.items() if n > numbering.get(key, 0)}
        runtime.writers.go_on_from(overheard)

    def become(self, incarnation: int) -> None:
        """Be called another incarnation from now on; control queries under the former one are still answered."""
        runtime = self._runtime
        runtime.assignment = replace(runtime.assignment, incarnation=incarnation)
        runtime.listen_for_control()
        runtime.caller.go_on_from(runtime.caller.asked + NUMBERS_LEFT_OUT)

    def forget(self) -> None:
        """End what was frozen, without a word to anybody: another state is about to be restored."""
        if self._runtime.state is State.ACTIVE:
            self._runtime.lifecycle.perform(Transition.DEACTIVATE)
        self._overheard.clear()

    def leave(self) -> None:
        """Disappear from beside the component."""
        for closable in (*self._listening, *([self._token] if self._token else [])):
            closable.close()
        self._listening.clear()
        self._token = None
