"""Control queries: what tools and the adaptation manager ask of a component, served between two handlers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from regraft.bus.interface import Query
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import known_types
from regraft.bus_schema.errors import BadMessage, SchemaError
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.protocol.control import (
    AskQualities,
    AskTypes,
    ControlCode,
    KnownTypes,
    ParameterValues,
    Qualities,
    Resend,
    Resent,
    Rewire,
    RewireStep,
    SetTransition,
    StateRequest,
    StateStep,
)
from regraft.bus_schema.messages.protocol.handover import Role
from regraft.bus_schema.model.description import types_in
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.texts import text_of
from regraft.bus_schema.types_by_schema import describe_type
from regraft.component.component import describe
from regraft.component.parameters import ParameterError
from regraft.component.predicting import predicted
from regraft.runtime.core.clock import SteppedClock
from regraft.runtime.core.control_refusal import ControlRefused
from regraft.runtime.core.pending import Pending
from regraft.runtime.data.fetching import RESEND
from regraft.runtime.handover.protocol import HandoverProtocol
from regraft.runtime.lifecycle.answering import Answering
from regraft.runtime.lifecycle.checkpoints import Checkpoints
from regraft.runtime.lifecycle.fence import Fence
from regraft.runtime.lifecycle.lifecycle import Lifecycle, TransitionFailed
from regraft.runtime.lifecycle.measuring import Measuring
from regraft.runtime.lifecycle.own_faults import OwnFaults
from regraft.runtime.lifecycle.port_rewiring import Rewiring, RewiringRefused
from regraft.runtime.parts import Parts


class Control:
    """The control queries of one component."""

    def __init__(
        self,
        parts: Parts,
        lifecycle: Lifecycle,
        rewiring: Rewiring,
        handover: HandoverProtocol,
        checkpoints: Checkpoints,
        answering: Answering,
        fence: Fence,
        measuring: Measuring,
        retime: Callable[[], None],
    ) -> None:
        self._parts = parts
        self._lifecycle = lifecycle
        self._rewiring = rewiring
        self._handover = handover
        self._checkpoints = checkpoints
        self._answering = answering
        self._fence = fence
        self._measuring = measuring
        self._retime = retime
        self._verbs: dict[str, Callable[[bytes], object]] = {
            "describe": self._describe,
            "transition": self._transition,
            "parameters": self._parameters,
            "connections": self._connections,
            "state": self._state,
            "handover": handover.step,
            "resend": self._resend,
            "types": self._types,
            "qualities": self._measured,
            "fault": OwnFaults(parts).inject,
        }

    def take(self, query: Query) -> None:
        """Answer a query, now or when what it waits for has happened."""
        self._parts.writers.flush()
        if not self._is_live and self._is_for_any_run(query):
            query.drop()
            return
        requirements = self._parts.presence.requirements
        if query.key in requirements:
            self._answering.answer(query, lambda: requirements[query.key])
            return
        verb = query.key.rsplit("/", 1)[-1]
        self._answering.answer(query, lambda: self._ask(verb, query.payload))

    @property
    def _is_live(self) -> bool:
        return self._handover.role is Role.LIVE

    def _is_for_any_run(self, query: Query) -> bool:
        """Return whether a query is for the run that speaks, whichever that is: its asker takes the first answer."""
        if query.key in self._parts.presence.requirements:
            return True
        if not query.key.endswith(RESEND):
            return False
        try:
            return codec.decode(query.payload, Resend).epoch == 0
        except BadMessage:
            return False

    def _ask(self, verb: str, payload: bytes) -> object:
        if verb in self._verbs:
            return self._verbs[verb](payload)
        known = ", ".join(self._verbs)
        raise ControlRefused(ControlCode.MALFORMED, f"there is no control query {verb!r}; there are: {known}")

    def _describe(self, payload: bytes) -> object:
        if payload:
            return self._qualities(codec.decode(payload, AskQualities))
        return describe(type(self._parts.component), self._parts.parameters.values)

    def _types(self, payload: bytes) -> KnownTypes:
        wanted = codec.decode(payload, AskTypes) if payload else AskTypes()
        names = wanted.names or types_in(describe(type(self._parts.component), self._parts.parameters.values))
        known = {kind.name: kind for kind in known_types()}
        return KnownTypes(tuple(describe_type(known[name]) for name in names if name in known))

    def _measured(self, payload: bytes) -> MeasuredQualities:
        if payload:
            raise BadMessage("must be empty: the query takes nothing")
        return self._measuring.last()

    def _qualities(self, asked: AskQualities) -> Qualities:
        parts = self._parts
        try:
            changed = parts.parameters.check(asked.parameters, starting=True)
        except ParameterError as error:
            raise ControlRefused(ControlCode.REFUSED, *error.problems) from None
        described = tuple(quality.describe() for quality in parts.declared.qualities.values())
        parameters = {**parts.parameters.plain(), **changed}
        estimates = predicted(type(parts.component), described, parameters, asked.context)
        measurements = self._measuring.measure() if parts.state is State.ACTIVE else None
        return Qualities(
            parts.assignment.name,
            parts.assignment.incarnation,
            parts.clock.now() / 1e9,
            estimates.values,
            measurements.values if measurements is not None else {},
            estimates.problems | (measurements.problems if measurements is not None else {}),
        )

    def _transition(self, payload: bytes) -> object:
        wanted = codec.decode(payload, SetTransition)
        self._fence.check(wanted.term)
        self._refuse_unless_live()
        if wanted.time is not None and isinstance(self._parts.clock, SteppedClock):
            self._parts.clock.advance_to(wanted.time)
        try:
            self._lifecycle.perform(wanted.transition, hold=wanted.hold)
        except TransitionFailed as error:
            raise ControlRefused(ControlCode.FAILED, f"transition {error}") from None
        self._answering.note_revision(wanted.revision)
        return self._answering.view()

    def _parameters(self, payload: bytes) -> object:
        wanted = codec.decode(payload, ParameterValues) if payload else ParameterValues()
        if wanted.values:
            self._fence.check(wanted.term)
            self._refuse_unless_live()
            self._set_parameters(wanted.values)
            self._answering.note_revision(wanted.revision)
        return self._answering.view()

    def _set_parameters(self, values: dict[str, Any]) -> None:
        parts = self._parts
        before = parts.parameters.values
        try:
            parts.parameters.set(values)
        except ParameterError as error:
            raise ControlRefused(ControlCode.REFUSED, *error.problems) from None
        changed = frozenset(name for name, value in parts.parameters.values.items() if value != before[name])
        if not changed:
            return
        try:
            parts.component.on_parameters(changed)
        except Exception as error:
            parts.parameters.values = before
            why = text_of(error) or type(error).__name__
            raise ControlRefused(ControlCode.REFUSED, f"{', '.join(sorted(changed))}: {why}") from None
        self._retime()
        self._measuring.invalidate("not measured since parameters have changed")

    def _connections(self, payload: bytes) -> object:
        wanted = codec.decode(payload, Rewire) if payload else Rewire(RewireStep.READ)
        if wanted.step not in (RewireStep.READ, RewireStep.AWAIT):
            self._fence.check(wanted.term)
            if wanted.step is not RewireStep.MARK:
                self._refuse_unless_live()
        try:
            done = self._rewiring.step(wanted)
        except (RewiringRefused, SchemaError) as error:
            raise ControlRefused(ControlCode.REFUSED, str(error)) from None
        self._answering.note_revision(wanted.revision)
        moved = wanted.step in (RewireStep.SWITCH, RewireStep.DISCONNECT)
        if isinstance(done, Pending):
            if moved:
                done.afterwards = self._connections_changed
            return done
        if moved:
            self._connections_changed()
        return self._answering.view(done)

    def _connections_changed(self) -> None:
        self._measuring.invalidate("not measured since connections have changed")

    def _state(self, payload: bytes) -> object:
        wanted = codec.decode(payload, StateRequest) if payload else StateRequest(StateStep.SNAPSHOT)
        if wanted.step is StateStep.SNAPSHOT:
            return self._checkpoints.encoded(self._checkpoints.snapshot())
        self._fence.check(wanted.term)
        self._refuse_unless_live()
        version = type(self._parts.component).state_version
        if wanted.version != version:
            raise ControlRefused(
                ControlCode.REFUSED, f"state: has version {wanted.version}, this class takes {version}"
            )
        self._parts.component.restore(wanted.state)
        self._checkpoints.forget_assigned()
        return self._answering.view()

    def _resend(self, payload: bytes) -> Resent:
        return self._parts.writers.resend(codec.decode(payload, Resend))

    def answer_meanwhile(self, query: Query) -> bool:
        """Answer a question for samples from within a handler; returns False if it has to wait for its end."""
        try:
            asked = codec.decode(query.payload, Resend)
        except BadMessage:
            return False
        writers = self._parts.writers
        if writers.is_making(asked) or not self._is_live:
            return False
        self._answering.answer(query, lambda: writers.resend_made(asked))
        return True

    def _refuse_unless_live(self) -> None:
        if not self._is_live:
            role = self._handover.role.value
            raise ControlRefused(ControlCode.REFUSED, f"this run is {role}: another one speaks for the component")
