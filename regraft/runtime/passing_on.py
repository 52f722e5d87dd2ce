"""What one run of a component passes on to the next: made by the incumbent, taken in by the successor."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from bus_schema.messages.handover import HandedOver, HandoverOffer, HeldSample, StreamPlace
from bus_schema.model.lifecycle import State, Transition
from regraft.bus import Sample
from regraft.clock import SteppedClock
from regraft.component import Component, class_path, restore_state
from regraft.parameters import ParameterError
from regraft.runtime.held import First, Held, envelope_of, is_held
from regraft.runtime.stream import Stream
from regraft.runtime.writers import Identity

if TYPE_CHECKING:
    from regraft.runtime.runtime import Runtime


def offer(runtime: Runtime) -> HandoverOffer:
    """Return what a successor has to know before anything is touched."""
    cls = type(runtime.component)
    return HandoverOffer(
        runtime.assignment.name,
        runtime.assignment.incarnation,
        class_path(cls),
        runtime.identity.epoch,
        runtime.state,
        cls.snapshot is not Component.snapshot,
        cls.state_version,
        runtime.handler_timeout * (2 if cls.is_exclusive() else 1),
        runtime.parameters.plain(),
        {key: writer.encoding for key, writer in runtime.writers.open_keys.items()},
        runtime.clock.now(),
        runtime.tick,
    )


def misfits(runtime: Runtime, offered: HandoverOffer, *, with_state: bool) -> list[str]:
    """Return why this run cannot go on from the incumbent."""
    if offered.state not in (State.ACTIVE, State.INACTIVE):
        return [
            f"incarnation {offered.incarnation} is {offered.state.value}: only an active or inactive one hands over"
        ]
    if not with_state:
        return []
    cls = type(runtime.component)
    restores = cls.restore is not Component.restore
    if offered.stateful and not restores:
        return [f"the incumbent has a state of version {offered.version}, and {cls.__qualname__} restores none"]
    if restores and not offered.stateful:
        return [f"{cls.__qualname__} restores a state of version {cls.state_version}, and the incumbent gives none"]
    if restores and offered.version not in cls.restorable_versions():
        taken = ", ".join(map(str, cls.restorable_versions()))
        return [f"the incumbent's state has version {offered.version}, {cls.__qualname__} takes {taken}"]
    return []


def hand_over(runtime: Runtime, held: Held, first: First, frozen_at: int, *, with_state: bool = True) -> HandedOver:
    """Return all that the successor needs, which holds everything from ``first`` on itself."""
    streams = runtime.inbound.streams
    early = (stream.waiting[n][1] for stream in streams.values() for n in sorted(stream.waiting))
    return HandedOver(
        runtime.control.snapshot(with_state=with_state),
        frozen_at,
        runtime.state,
        runtime.identity.epoch,
        runtime.parameters.plain(),
        runtime.writers.numbering(),
        tuple(runtime.inbound.consumers),
        tuple(StreamPlace(*pair, s.epoch, s.incarnation, s.handled, s.wired, s.since) for pair, s in streams.items()),
        tuple(HeldSample(*sample) for sample in (*early, *held.samples) if not _has(first, sample)),
        {name: _named(first, port.hand_over()) for name, port in runtime.inputs.items()},
        tuple(client for server in runtime.servers for client in server.hand_over()),
        runtime.caller.asked,
        {timer.name: timer.due for timer in runtime.timers.periodic},
        dict(runtime.writers.advanced) if runtime.stepped else {},
    )


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


def set_clock(runtime: Runtime, now: int, tick: int | None) -> None:
    """Live at the time of the incumbent, if this is a member of simulated time: nobody has told this run yet."""
    if runtime.stepped and isinstance(runtime.clock, SteppedClock):
        runtime.clock.advance_to(now)
        runtime.tick = tick


def take_over(runtime: Runtime, handed: HandedOver, held: Held, *, with_state: bool) -> int:
    """Go on where the incumbent froze; returns the nanoseconds for which nobody spoke for the component.

    Raises:
        Exception: the class does not take the state, or could not be activated.
    """
    runtime.control.take_checkpoint()  # older than what is handed over
    if with_state and type(runtime.component).restore is not Component.restore:
        restore_state(runtime.component, handed.snapshot.state, handed.snapshot.version)
    _take_places(runtime, handed)
    _take_inputs(runtime, handed, held)
    speak(runtime, handed.epoch)
    runtime.writers.advanced |= handed.advanced
    if handed.state is State.ACTIVE:
        runtime.lifecycle.perform(Transition.ACTIVATE)
        _take_timers(runtime, handed)
        for server in runtime.servers:
            server.begin_again()
    else:
        runtime.herald.beat()
    _take_streams(runtime, handed)
    silent = runtime.clock.now() - handed.frozen_at
    recent = {id(sample) for sample in held.since_mark()}
    samples = held.take_all()
    handle(runtime, (Sample(h.key, h.payload, h.attachment, h.encoding) for h in handed.unhandled))
    handle(runtime, (s for s in samples if id(s) in recent or _was_read(runtime, handed, s)))
    return silent


def _was_read(runtime: Runtime, handed: HandedOver, sample: Sample) -> bool:
    return runtime.keys.topic_of(sample.key) is None or sample.key in handed.reads


def speak(runtime: Runtime, epoch: int) -> None:
    """Speak for the component from now on, in the numbering that began with ``epoch``."""
    name, incarnation = runtime.assignment.name, runtime.assignment.incarnation
    runtime.identity = Identity(name, epoch, incarnation)
    runtime.writers.speak_as(runtime.identity)
    runtime.herald.speak_as(Identity(name, incarnation, incarnation))


def handle(runtime: Runtime, samples: Iterable[Sample]) -> None:
    """Handle what was held, in its order."""
    for sample in samples:
        runtime.inbound.arrive(sample)
    runtime.work()


def take_parameters(runtime: Runtime, values: dict[str, object]) -> None:
    """Take the incumbent's values of what the assignment leaves open, where they fit this class."""
    mine = runtime.parameters.values
    given = runtime.assignment.parameters
    changed = []
    for name, value in values.items():
        declared = runtime.declared.parameters.get(name)
        if declared is None or declared.read_only or name in given:
            continue
        before = mine[name]
        try:
            runtime.parameters.set({name: value})
        except ParameterError:
            continue
        if runtime.parameters.values[name] != before:
            changed.append(name)
    if changed and runtime.state is not State.UNCONFIGURED:
        runtime.component.on_parameters(frozenset(changed))


def _take_places(runtime: Runtime, handed: HandedOver) -> None:
    runtime.writers.go_on_from(handed.writes)
    runtime.caller.go_on_from(handed.asked)
    for server in runtime.servers:
        server.take_over(client for client in handed.clients if client.service == server.name)


def _take_streams(runtime: Runtime, handed: HandedOver) -> None:
    """Go on with the streams of the inputs: behind activating them, for that begins them anew."""
    for p in handed.streams:
        if runtime.inbound.consumer_of(p.key) is not None:
            stream = Stream(p.epoch, p.incarnation, p.handled, p.wired, since=p.since)
            runtime.inbound.go_on(p.key, p.source, stream)


def _take_inputs(runtime: Runtime, handed: HandedOver, held: Held) -> None:
    by_attachment = {(sample.key, sample.attachment): sample for sample in held.samples}
    for name, samples in handed.inputs.items():
        port = runtime.inputs.get(name)
        if port is None or not samples:
            continue
        newest, *kept = (Sample(h.key, h.payload, h.attachment, h.encoding) for h in samples)
        port.take_over(newest if newest.encoding else by_attachment.get((newest.key, newest.attachment)), kept)


def _take_timers(runtime: Runtime, handed: HandedOver) -> None:
    """Keep the rhythm: what is called at the same rate as before is due when it was due."""
    now = runtime.clock.now()
    for timer in runtime.timers.periodic:
        due = handed.timers.get(timer.name)
        if due is not None and due <= now + timer.period:
            timer.due = due
