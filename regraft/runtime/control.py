"""Control queries: what tools and the adaptation manager ask of a component, served between two handlers."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bus_schema.described import describe_type
from bus_schema.encoding import codec
from bus_schema.encoding.registry import known_types, type_of
from bus_schema.errors import BadMessage, SchemaError
from bus_schema.messages.control import (
    AskQualities,
    AskTypes,
    ComponentView,
    ControlCode,
    ControlError,
    KnownTypes,
    ParameterValues,
    Qualities,
    Resend,
    Resent,
    Rewire,
    RewireStep,
    SetTransition,
    Snapshot,
    StateRequest,
    StateStep,
)
from bus_schema.messages.handover import Role
from bus_schema.messages.host import HostStatus
from bus_schema.model.description import types_in
from bus_schema.model.lifecycle import State
from regraft.bus import BusError, Query
from regraft.component import Component, describe
from regraft.fencing import Fenced, in_force
from regraft.parameters import ParameterError
from regraft.runtime.lifecycle import TransitionFailed
from regraft.runtime.refusal import ControlRefused
from regraft.runtime.rewiring import Pending, RewiringRefused
from regraft.runtime.state_size import check_size

if TYPE_CHECKING:
    from regraft.runtime.runtime import Runtime

HOST_ANSWER_TIMEOUT = 0.3
"""Seconds that a host may take to say which term has begun: less than a heartbeat may stay away."""


@dataclass(slots=True)
class _Parked:
    query: Query
    pending: Pending
    deadline: int

    def is_over(self) -> bool:
        """Tell whether what it waits for has happened, or the time is up."""
        return self.pending.ready() or time.monotonic_ns() >= self.deadline


class Control:
    """Answers the control queries of one component."""

    def __init__(self, runtime: Runtime) -> None:
        """Fenced by the assignment's term, which a later one replaces."""
        self._runtime = runtime
        self._term = runtime.assignment.term
        self._revised = False
        self.parked: list[_Parked] = []
        self._checkpoint = runtime.assignment.checkpoint
        self._verbs: dict[str, Callable[[bytes], object]] = {
            "describe": self._describe,
            "transition": self._transition,
            "parameters": self._parameters,
            "connections": self._connections,
            "state": self._state,
            "handover": runtime.handover.step,
            "resend": self._resend,
            "types": self._types,
        }

    def take(self, query: Query) -> None:
        """Answer a query, now or when what it waits for has happened."""
        self._runtime.writers.keep_promises()
        verb = query.key.rsplit("/", 1)[-1]
        if query.key in self._runtime.requirements:
            self._answer(query, lambda: self._runtime.requirements[query.key])
            return
        pending = self._answer(query, lambda: self._ask(verb, query.payload))
        if pending is not None:
            self.parked.append(_Parked(query, pending, time.monotonic_ns() + pending.at_most))
            self.answer_parked()
        if self._revised:
            self._revised = False
            self._runtime.herald.beat_soon()

    def _ask(self, verb: str, payload: bytes) -> object:
        return self._verbs[verb](payload) if verb in self._verbs else self._unknown(verb)

    def _answer(self, query: Query, produce: Callable[[], object]) -> Pending | None:
        """Answer with what ``produce`` returns or raises, unless it returns that the answer has to wait."""
        verb = query.key.rsplit("/", 1)[-1]
        try:
            answer = produce()
            if isinstance(answer, Pending):
                return answer
            view = self.view(answer) if isinstance(answer, dict) else answer
            payload = view if isinstance(view, bytes) else codec.encode(view)
        except ControlRefused as refusal:
            self._refuse(query, refusal.code, refusal.problems)
        except SchemaError as error:
            self._refuse(query, ControlCode.MALFORMED, (f"{verb}: {error}",))
        except Exception as error:
            self._runtime.herald.fault(f"control query {verb!r}", error)
            self._refuse(query, ControlCode.FAILED, (f"{verb}: {type(error).__name__}: {error}",))
        else:
            query.reply(payload)
        return None

    def answer_parked(self) -> None:
        """Answer the queries whose wait is over."""
        # One by one: what is done after an answer may answer others.
        while (parked := next((p for p in self.parked if p.is_over()), None)) is not None:
            self.parked.remove(parked)
            self._answer(parked.query, parked.pending.finish)
            if parked.pending.afterwards:
                parked.pending.afterwards()

    def seconds_to_next(self) -> float | None:
        """Return how long the next parked answer may still wait, None if none is parked."""
        if not self.parked:
            return None
        return max(0.0, (min(p.deadline for p in self.parked) - time.monotonic_ns()) / 1e9)

    def view(self, detail: dict[str, Any] | None = None) -> ComponentView:
        """Return the component as it is now."""
        runtime = self._runtime
        ends = {name: port.key for name, port in runtime.inputs.items()}
        ends |= {name: port.key for name, port in runtime.outputs.items()}
        connections = {name: runtime.keys.topic_of(key) or "" for name, key in ends.items()}
        return ComponentView(
            runtime.assignment.name,
            runtime.assignment.incarnation,
            runtime.state,
            runtime.herald.status.revision,
            runtime.parameters.plain(),
            connections,
            detail or {},
            runtime.herald.status.error,
            runtime.herald.faults,
        )

    @staticmethod
    def _refuse(query: Query, code: ControlCode, problems: tuple[str, ...]) -> None:
        query.reply(codec.encode(ControlError(code, tuple(problem[:2000] for problem in problems))), error=True)

    def _unknown(self, verb: str) -> object:
        known = ", ".join(self._verbs)
        raise ControlRefused(ControlCode.REFUSED, f"there is no control query {verb!r}; there are: {known}")

    def fence(self, term: int | None) -> None:
        """Accept changes only from the manager's current term; a later term replaces it."""
        if self._term is None:
            return
        known = self._term_of_a_host() if term is not None and term > self._term else None
        try:
            self._term = in_force(term, self._term, known)
        except Fenced as error:
            raise ControlRefused(ControlCode.FENCED, str(error)) from None

    def _term_of_a_host(self) -> int | None:
        """Return the term that a host knows: a manager tells hosts first. None if no host answers."""
        runtime = self._runtime
        try:
            answers = runtime.bus.query(runtime.keys.host("*", "runs"), b"", HOST_ANSWER_TIMEOUT)
            return next((codec.decode(a.payload, HostStatus).term for a in answers if not a.error), None)
        except (BusError, BadMessage):
            return None

    def _describe(self, payload: bytes) -> object:
        if payload:
            return self._qualities(codec.decode(payload, AskQualities))
        return describe(type(self._runtime.component), self._runtime.parameters.values)

    def _types(self, payload: bytes) -> KnownTypes:
        wanted = codec.decode(payload, AskTypes) if payload else AskTypes()
        names = wanted.names or types_in(describe(type(self._runtime.component), self._runtime.parameters.values))
        known = {kind.name: kind for kind in known_types()}
        return KnownTypes(tuple(describe_type(known[name]) for name in names if name in known))

    def _qualities(self, asked: AskQualities) -> Qualities:
        runtime = self._runtime
        try:
            changed = runtime.parameters.check(asked.parameters, starting=True)
        except ParameterError as error:
            raise ControlRefused(ControlCode.REFUSED, *error.problems) from None
        component = runtime.component
        qualities = Qualities(
            runtime.assignment.name,
            runtime.assignment.incarnation,
            runtime.clock.now() / 1e9,
            component.estimate({**runtime.parameters.plain(), **changed}, dict(asked.context)),
            component.evaluate() if runtime.state is State.ACTIVE else {},
        )
        codec.to_plain(qualities)  # raises BadMessage for what is no finite number by a name
        return qualities

    def _transition(self, payload: bytes) -> object:
        wanted = codec.decode(payload, SetTransition)
        self.fence(wanted.term)
        self._refuse_unless_live()
        try:
            self._runtime.lifecycle.perform(wanted.transition, hold=wanted.hold)
        except TransitionFailed as error:
            raise ControlRefused(ControlCode.FAILED, f"transition {error}") from None
        self.note_revision(wanted.revision)
        return self.view()

    def _parameters(self, payload: bytes) -> object:
        wanted = codec.decode(payload, ParameterValues) if payload else ParameterValues()
        if wanted.values:
            self.fence(wanted.term)
            self._refuse_unless_live()
            self._set_parameters(wanted.values)
            self.note_revision(wanted.revision)
        return self.view()

    def _set_parameters(self, values: dict[str, Any]) -> None:
        runtime = self._runtime
        before = runtime.parameters.values
        try:
            runtime.parameters.set(values)
        except ParameterError as error:
            raise ControlRefused(ControlCode.REFUSED, *error.problems) from None
        changed = frozenset(name for name, value in runtime.parameters.values.items() if value != before[name])
        if not changed:
            return
        try:
            runtime.component.on_parameters(changed)
        except Exception as error:
            runtime.parameters.values = before
            raise ControlRefused(ControlCode.REFUSED, f"{', '.join(sorted(changed))}: {error}") from None
        runtime.retime()

    def _connections(self, payload: bytes) -> object:
        wanted = codec.decode(payload, Rewire) if payload else Rewire(RewireStep.READ)
        if wanted.step not in (RewireStep.READ, RewireStep.AWAIT):
            self.fence(wanted.term)
            if wanted.step is not RewireStep.MARK:
                self._refuse_unless_live()
        try:
            done = self._runtime.rewiring.step(wanted)
        except (RewiringRefused, SchemaError) as error:
            raise ControlRefused(ControlCode.REFUSED, str(error)) from None
        self.note_revision(wanted.revision)
        return done if isinstance(done, Pending) else self.view(done)

    def _state(self, payload: bytes) -> object:
        wanted = codec.decode(payload, StateRequest) if payload else StateRequest(StateStep.SNAPSHOT)
        if wanted.step is StateStep.SNAPSHOT:
            snapshot = self.snapshot()
            self._payload_of(snapshot)
            return snapshot
        self.fence(wanted.term)
        self._refuse_unless_live()
        version = type(self._runtime.component).state_version
        if wanted.version != version:
            raise ControlRefused(
                ControlCode.REFUSED, f"state: has version {wanted.version}, this class takes {version}"
            )
        self._runtime.component.restore(wanted.state)
        return self.view()

    def _resend(self, payload: bytes) -> Resent:
        return self._runtime.writers.resend(codec.decode(payload, Resend))

    def _refuse_unless_live(self) -> None:
        role = self._runtime.handover.role
        if role is not Role.LIVE:
            raise ControlRefused(ControlCode.REFUSED, f"this run is {role.value}: another one speaks for the component")

    def note_revision(self, revision: int | None) -> None:
        """Report ``revision`` from now on, if one was told."""
        if revision is not None:
            herald = self._runtime.herald
            herald.status = replace(herald.status, revision=revision)
            self._revised = True

    # --- snapshots and checkpoints ---

    def snapshot(self, *, with_state: bool = True) -> Snapshot:
        """Return the component's state, unless it is not wanted, and where its numbering stands."""
        runtime = self._runtime
        state = runtime.component.snapshot() if with_state else None
        try:
            check_size(state)
        except BadMessage as error:
            raise ControlRefused(ControlCode.FAILED, f"snapshot: {error}") from None
        return Snapshot(
            runtime.assignment.name,
            runtime.assignment.incarnation,
            runtime.clock.now() / 1e9,
            type(runtime.component).state_version,
            state,
            runtime.writers.sequences(),
        )

    @staticmethod
    def _payload_of(snapshot: Snapshot) -> bytes:
        try:
            return codec.encode(snapshot)
        except BadMessage as error:
            raise ControlRefused(ControlCode.FAILED, f"snapshot: {error}") from None

    def checkpoint(self) -> None:
        """Put a checkpoint, for the host to keep."""
        self.put_checkpoint(self.snapshot())

    def put_checkpoint(self, snapshot: Snapshot) -> None:
        """Put a snapshot that was taken before."""
        key = self._runtime.keys.checkpoint(self._runtime.assignment.name)
        self._runtime.herald.put(key, type_of(Snapshot), self._payload_of(snapshot))

    @property
    def keeps_state(self) -> bool:
        """Whether the component has a state to keep."""
        return type(self._runtime.component).snapshot is not Component.snapshot

    def take_checkpoint(self) -> Snapshot | None:
        """Return the checkpoint that came with the assignment, once, if this class understands it."""
        checkpoint, self._checkpoint = self._checkpoint, None
        if checkpoint is None or checkpoint.version not in type(self._runtime.component).restorable_versions():
            return None
        return checkpoint
