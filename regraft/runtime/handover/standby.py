"""A run that does not speak for its component: it keeps what arrives, answers control queries, keeps its heartbeat."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from regraft.bus.interface import Closable, Sample
from regraft.bus_schema.messages.protocol.handover import Role
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.runtime.data.replay_buffer import ReplayBuffer, envelope_of
from regraft.runtime.data.stream import Stream
from regraft.runtime.data.writers import Identity
from regraft.runtime.lifecycle.answering import Answering
from regraft.runtime.lifecycle.lifecycle import Lifecycle
from regraft.runtime.parts import Parts

NUMBERS_LEFT_OUT = 1_000_000
"""Numbers of requests that a run leaves out with a new incarnation: its successor may have used some in its name."""


class Standby:
    """A run's role, and what it does while that is not to be live."""

    def __init__(
        self,
        parts: Parts,
        lifecycle: Lifecycle,
        answering: Answering,
        saw_marker: Callable[[str, str, Stream], None],
        take: Callable[[Any], None],
    ) -> None:
        self.role = Role.LIVE if parts.assignment.succeeds is None else Role.WAITING
        self.held = ReplayBuffer()
        self.later: list[Any] = []
        self._parts = parts
        self._lifecycle = lifecycle
        self._answering = answering
        self._saw_marker = saw_marker
        self._take = take
        self._overheard: dict[str, int] = {}
        self._listening: list[Closable] = []
        self._token: Closable | None = None

    def stand_still(self) -> None:
        """Keep what arrives, answer control queries, keep the heartbeat; until this run is live, or is to end."""
        parts = self._parts
        if self.role is Role.FROZEN:
            self._listen_to_successor()
        later, self.later = self.later, []
        for item in later:
            self._take(item)
        while self.role is not Role.LIVE and parts.state is not State.FINALIZED:
            self._answering.answer_parked()
            wait, parked = parts.reporter.beat_if_due(), self._answering.seconds_to_next()
            item = parts.inbox.get(wait if parked is None else min(wait, parked))
            if item is not None:
                self._keep(item)

    def _keep(self, item: Any) -> None:
        """Take one item: samples are kept, everything else is answered or done."""
        sample = self._parts.bus.open_sample(item)
        if sample is None:
            self._take(item)
        else:
            self.keep_sample(sample)

    def keep_sample(self, sample: Sample) -> None:
        """Keep a sample, and note what it states by itself."""
        parts = self._parts
        envelope = envelope_of(sample)
        if envelope is not None:
            if not sample.payload:
                seen = Stream(envelope.epoch, envelope.incarnation, envelope.sequence)
                self._saw_marker(sample.key, envelope.source, seen)
            elif envelope.source == parts.assignment.name and envelope.epoch == parts.identity.epoch:
                self.overhear({sample.key: envelope.sequence})
        if parts.inbound.consumer_of(sample.key) is not None:
            self.held.add(sample, envelope)

    def overhear(self, numbering: dict[str, int]) -> None:
        """Note how far the successor has numbered."""
        for key, sequence in numbering.items():
            self._overheard[key] = max(sequence, self._overheard.get(key, 0))

    def _listen_to_successor(self) -> None:
        """Hear how far the successor numbers what it writes in this component's name."""
        parts = self._parts
        self._listening = [parts.bus.subscribe(key, parts.inbox.put) for key in parts.writers.open_keys]

    def step_aside(self) -> None:
        """Speak for the component no more, but next to it."""
        assignment = self._parts.assignment
        aside = Identity(f"{assignment.name}+", assignment.incarnation, assignment.incarnation)
        self._parts.writers.speak_as(aside, mute=True)
        self._parts.reporter.speak_as(aside, standby=True)

    def show(self) -> None:
        """Show the token of a standby run."""
        assignment = self._parts.assignment
        if self._token is None:
            key = self._parts.keys.standby(assignment.name, assignment.incarnation)
            self._token = self._parts.bus.announce(key)

    def be_live(self) -> None:
        """Speak for the component from now on."""
        self.role = Role.LIVE
        self._parts.presence.appear()
        self.leave()

    def go_on(self) -> None:
        """Handle what was kept, and what was put off; number on from what was overheard."""
        parts = self._parts
        parts.handle(self.held.take_all())
        later, self.later = self.later, []
        for item in later:
            parts.inbox.put(item)
        overheard, self._overheard = self._overheard, {}
        numbering = parts.writers.numbering()
        # The successor's messages count, but nobody has acknowledged them.
        parts.writers.advanced |= {key: n for key, n in overheard.items() if n > numbering.get(key, 0)}
        parts.writers.go_on_from(overheard)

    def become(self, incarnation: int) -> None:
        """Be called another incarnation from now on; control queries under the former one are still answered."""
        parts = self._parts
        parts.assignment = replace(parts.assignment, incarnation=incarnation)
        parts.presence.listen_for_control()
        parts.requests.go_on_from(parts.requests.asked + NUMBERS_LEFT_OUT)

    def end_former(self) -> None:
        """End what was frozen, without a word to anybody: another state is about to be restored."""
        if self._parts.state is State.ACTIVE:
            self._lifecycle.perform(Transition.DEACTIVATE)

    def forget_overheard(self) -> None:
        """Forget how far the successor has numbered: this run continues there."""
        self._overheard.clear()

    def leave(self) -> None:
        """Disappear from the standby place."""
        for closable in (*self._listening, *([self._token] if self._token else [])):
            closable.close()
        self._listening.clear()
        self._token = None
