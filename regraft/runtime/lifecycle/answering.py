"""Answers control queries, at once or when what they wait for has happened."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from regraft.bus.interface import Query
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.messages.protocol.control import ComponentView, ControlCode, ControlError
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.texts import encodable, told
from regraft.runtime.core.control_refusal import ControlRefused
from regraft.runtime.core.pending import Pending
from regraft.runtime.parts import Parts


@dataclass(slots=True)
class _Parked:
    query: Query
    pending: Pending
    deadline: int

    def is_over(self) -> bool:
        """Return whether what it waits for has happened, or the time is up."""
        return self.pending.ready() or time.monotonic_ns() >= self.deadline


class Answering:
    """The answers to the control queries of one component.

    Attributes:
        parked: the queries whose answers wait.
    """

    def __init__(self, parts: Parts) -> None:
        self.parked: list[_Parked] = []
        self._parts = parts
        self._revised = False

    def answer(self, query: Query, produce: Callable[[], object]) -> None:
        """Answer with what ``produce`` returns or raises, later if that is `Pending`."""
        self._parts.handle_newest()
        pending = self._try_to_answer(query, produce)
        if pending is not None:
            self.parked.append(_Parked(query, pending, time.monotonic_ns() + pending.at_most))
            self.answer_parked()
        if self._revised:
            self._revised = False
            self._parts.reporter.beat_soon()

    def _try_to_answer(self, query: Query, produce: Callable[[], object]) -> Pending | None:
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
            self._parts.reporter.fault(f"control query {verb!r}", error)
            self._refuse(query, ControlCode.FAILED, (f"{verb}: {told(error)}",))
        else:
            query.reply(payload)
        return None

    @staticmethod
    def _refuse(query: Query, code: ControlCode, problems: tuple[str, ...]) -> None:
        texts = tuple(encodable(problem)[:2000] for problem in problems)
        query.reply(codec.encode(ControlError(code, texts)), error=True)

    def answer_parked(self) -> None:
        """Answer the queries whose wait is over."""
        if not self.parked:
            return
        self._parts.handle_newest()
        # One by one: what is done after an answer may answer others.
        while (parked := next((p for p in self.parked if p.is_over()), None)) is not None:
            self.parked.remove(parked)
            self._try_to_answer(parked.query, parked.pending.finish)
            if parked.pending.afterwards:
                parked.pending.afterwards()

    def seconds_to_next(self) -> float | None:
        """Return how long the next parked answer may still wait, None if none is parked."""
        if not self.parked:
            return None
        return max(0.0, (min(p.deadline for p in self.parked) - time.monotonic_ns()) / 1e9)

    def note_revision(self, revision: int | None) -> None:
        """Report ``revision`` from now on, if there is one."""
        if revision is not None:
            reporter = self._parts.reporter
            reporter.status = replace(reporter.status, revision=revision)
            self._revised = True

    def view(self, detail: dict[str, Any] | None = None) -> ComponentView:
        """Return the component as it is now."""
        parts = self._parts
        ends = {name: port.key for name, port in parts.inputs.items()}
        ends |= {name: port.key for name, port in parts.outputs.items()}
        nothing = "" if parts.state in (State.UNCONFIGURED, State.FINALIZED) else None
        connections = {name: parts.keys.topic_of(key) or nothing for name, key in ends.items()}
        return ComponentView(
            parts.assignment.name,
            parts.assignment.incarnation,
            parts.state,
            parts.reporter.status.revision,
            parts.parameters.plain(),
            connections,
            detail or {},
            parts.reporter.status.error,
            parts.reporter.faults,
        )
