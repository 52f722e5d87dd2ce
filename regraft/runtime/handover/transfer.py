"""The transfer from one run of a component to the next: made by the incumbent, taken in by the successor."""

from __future__ import annotations

from regraft.bus.interface import Sample
from regraft.bus_schema.messages.protocol.handover import HandedOver, HandoverOffer, HeldSample, StreamPlace
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.component.component import Component, class_path, restore_state
from regraft.component.parameters import ParameterError
from regraft.runtime.core.clock import SteppedClock
from regraft.runtime.data.replay_buffer import First, ReplayBuffer, envelope_of, is_held
from regraft.runtime.data.stream import Stream
from regraft.runtime.data.writers import Identity
from regraft.runtime.lifecycle.checkpoints import Checkpoints
from regraft.runtime.lifecycle.lifecycle import Lifecycle
from regraft.runtime.parts import Parts


class Transfer:
    """Takes one run's state, numbering and streams out of it, and puts those of another run in."""

    def __init__(self, parts: Parts, lifecycle: Lifecycle, checkpoints: Checkpoints) -> None:
        self._parts = parts
        self._lifecycle = lifecycle
        self._checkpoints = checkpoints

    def offer(self) -> HandoverOffer:
        """Return what a successor has to know before anything is touched."""
        cls = type(self._parts.component)
        return HandoverOffer(
            self._parts.assignment.name,
            self._parts.assignment.incarnation,
            class_path(cls),
            self._parts.identity.epoch,
            self._parts.state,
            cls.snapshot is not Component.snapshot,
            cls.state_version,
            self._parts.handler_timeout * (2 if cls.is_exclusive() else 1),
            self._parts.parameters.plain(),
            {key: writer.encoding for key, writer in self._parts.writers.open_keys.items()},
            self._parts.clock.now(),
            self._parts.tick,
        )

    def misfits(self, offered: HandoverOffer, *, with_state: bool) -> list[str]:
        """Return why this run cannot continue from the incumbent."""
        if offered.state not in (State.ACTIVE, State.INACTIVE):
            return [
                f"incarnation {offered.incarnation} is {offered.state.value}: only an active or inactive one hands over"
            ]
        if not with_state:
            return []
        cls = type(self._parts.component)
        restores = cls.restore is not Component.restore
        if offered.stateful and not restores:
            return [f"the incumbent has a state of version {offered.version}, and {cls.__qualname__} restores none"]
        if restores and not offered.stateful:
            return [f"{cls.__qualname__} restores a state of version {cls.state_version}, and the incumbent gives none"]
        if restores and offered.version not in cls.restorable_versions():
            taken = ", ".join(map(str, cls.restorable_versions()))
            return [f"the incumbent's state has version {offered.version}, {cls.__qualname__} takes {taken}"]
        return []

    def hand_over(self, held: ReplayBuffer, first: First, frozen_at: int, *, with_state: bool = True) -> HandedOver:
        """Return all that the successor needs, which holds everything from ``first`` on itself."""
        streams = self._parts.inbound.streams
        early = (stream.waiting[n][1] for stream in streams.values() for n in sorted(stream.waiting))
        return HandedOver(
            self._checkpoints.snapshot(with_state=with_state),
            frozen_at,
            self._parts.state,
            self._parts.identity.epoch,
            self._parts.parameters.plain(),
            self._parts.writers.numbering(),
            tuple(self._parts.inbound.consumers),
            tuple(
                StreamPlace(*pair, s.epoch, s.incarnation, s.handled, s.wired, s.since) for pair, s in streams.items()
            ),
            tuple(HeldSample(*sample) for sample in (*early, *held.samples) if not _has(first, sample)),
            {name: _named(first, port.hand_over()) for name, port in self._parts.inputs.items()},
            tuple(client for server in self._parts.servers for client in server.hand_over()),
            self._parts.requests.asked,
            {timer.name: timer.due for timer in self._parts.timers.periodic},
            dict(self._parts.writers.advanced) if self._parts.stepped else {},
            tuple(self._parts.presence.requirements.values()),
            self._parts.requests.given,
        )

    def set_clock(self, now: int, tick: int | None) -> None:
        """Live at the time of the incumbent, if this is a member of simulated time: this run has not received the time
        yet.
        """
        if self._parts.stepped and isinstance(self._parts.clock, SteppedClock):
            self._parts.clock.advance_to(now)
            self._parts.tick = tick

    def take_over(self, handed: HandedOver, held: ReplayBuffer, *, with_state: bool) -> int:
        """Continue where the incumbent froze; returns the nanoseconds for which nobody spoke for the component.

        Raises:
            Exception: the class does not take the state, or could not be activated.
        """
        self._checkpoints.forget_assigned()  # older than what is handed over
        # Before all that may fail: a frozen run that cannot take over speaks again, behind what its successor has put.
        self._parts.writers.go_on_from(handed.writes)
        if with_state and type(self._parts.component).restore is not Component.restore:
            restore_state(self._parts.component, handed.snapshot.state, handed.snapshot.version)
        self._take_places(handed)
        self._take_inputs(handed, held)
        self.speak(handed.epoch)
        self._parts.writers.advanced |= handed.advanced
        if handed.state is State.ACTIVE:
            self._lifecycle.perform(Transition.ACTIVATE)
            self._take_timers(handed)
            for server in self._parts.servers:
                key = self._parts.keys.request(server.name)
                server.begin_again({p.source for p in handed.streams if p.key == key})
        else:
            self._parts.reporter.beat()
        self._take_streams(handed)
        # Behind all that may fail: a frozen run that speaks again waits for its goals.
        self._parts.requests.cancel_given(handed.goals)
        silent = self._parts.clock.now() - handed.frozen_at
        recent = {id(sample) for sample in held.since_mark()}
        samples = held.take_all()
        self._parts.handle(Sample(h.key, h.payload, h.attachment, h.encoding) for h in handed.unhandled)
        self._parts.handle(s for s in samples if id(s) in recent or self._was_read(handed, s))
        return silent

    def _was_read(self, handed: HandedOver, sample: Sample) -> bool:
        return self._parts.keys.topic_of(sample.key) is None or sample.key in handed.reads

    def speak(self, epoch: int) -> None:
        """Speak for the component from now on, in the numbering that began with ``epoch``."""
        name, incarnation = self._parts.assignment.name, self._parts.assignment.incarnation
        self._parts.identity = Identity(name, epoch, incarnation)
        self._parts.writers.speak_as(self._parts.identity)
        self._parts.reporter.speak_as(Identity(name, incarnation, incarnation))

    def take_parameters(self, values: dict[str, object]) -> None:
        """Take the incumbent's values of what the assignment leaves open, where they fit this class."""
        mine = self._parts.parameters.values
        given = self._parts.assignment.parameters
        changed = []
        for name, value in values.items():
            declared = self._parts.declared.parameters.get(name)
            if declared is None or declared.read_only or name in given:
                continue
            before = mine[name]
            try:
                self._parts.parameters.set({name: value})
            except ParameterError:
                continue
            if self._parts.parameters.values[name] != before:
                changed.append(name)
        if changed and self._parts.state is not State.UNCONFIGURED:
            self._parts.component.on_parameters(frozenset(changed))

    def _take_places(self, handed: HandedOver) -> None:
        self._parts.requests.go_on_from(handed.asked)
        self._parts.presence.take_over(handed.requirements)
        for server in self._parts.servers:
            server.take_over(client for client in handed.clients if client.service == server.name)

    def _take_streams(self, handed: HandedOver) -> None:
        """Continue with the streams of the inputs: behind activating them, for that restarts them."""
        requests = {self._parts.keys.request(server.name) for server in self._parts.servers}
        for p in handed.streams:
            if self._parts.stepped and not p.wired and p.key in requests:
                self._parts.inbound.from_outside.add(p.source)
            if self._parts.inbound.consumer_of(p.key) is not None:
                stream = Stream(p.epoch, p.incarnation, p.handled, p.wired, since=p.since)
                self._parts.inbound.go_on(p.key, p.source, stream)

    def _take_inputs(self, handed: HandedOver, held: ReplayBuffer) -> None:
        by_attachment = {(sample.key, sample.attachment): sample for sample in held.samples}
        for name, samples in handed.inputs.items():
            port = self._parts.inputs.get(name)
            if port is None or not samples:
                continue
            newest, *kept = (Sample(h.key, h.payload, h.attachment, h.encoding) for h in samples)
            port.take_over(newest if newest.encoding else by_attachment.get((newest.key, newest.attachment)), kept)

    def _take_timers(self, handed: HandedOver) -> None:
        """Keep the rhythm: what is called at the same rate as before is due when it was due."""
        now = self._parts.clock.now()
        for timer in self._parts.timers.periodic:
            due = handed.timers.get(timer.name)
            if due is not None and due <= now + timer.period:
                timer.due = due


def _has(first: First, sample: Sample) -> bool:
    envelope = envelope_of(sample)
    return envelope is not None and is_held(first, sample.key, envelope)


def _named(first: First, samples: tuple[HeldSample, ...]) -> tuple[HeldSample, ...]:
    """Name a port's newest message rather than give it, where the successor has it: it may be an image."""
    if not samples:
        return samples
    newest = samples[0]
    if _has(first, Sample(newest.key, newest.payload, newest.attachment, newest.encoding)):
        newest = HeldSample(newest.key, b"", newest.attachment, "")
    return (newest, *samples[1:])
