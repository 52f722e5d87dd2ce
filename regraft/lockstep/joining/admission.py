"""Membership on request: in a slot, its holder starts and ends components, and time waits for both.

Otherwise a component joins when its process happens to be up, and one that leaves was lost. Asked for in a slot, both
happen between the same two ticks in every run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from regraft.bus.interface import Closable, Query
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.clock import ClockMember, Join, Membership
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError
from regraft.runtime.core.control_refusal import ControlRefused
from regraft.runtime.runtime import Runtime

Decide = Callable[[ClockMember], bool]


class Admission:
    """Answers the queries ``admit``, ``release`` and ``succeed``, on the source's thread, while a slot is granted."""

    def __init__(self, runtime: Runtime, admit: Decide, release: Decide, succeed: Decide) -> None:
        """Ask ``admit``, ``release`` and ``succeed``, which return whether the run is a member then."""
        self._runtime = runtime
        self._open = False
        self._released: set[tuple[str, int]] = set()
        self._verbs: dict[str, Decide] = {"admit": admit, "release": release, "succeed": succeed}

    def declare(self) -> list[Closable]:
        """Be found on the bus."""
        runtime = self._runtime
        return [runtime.bus.serve(runtime.keys.clock(verb), self._sink(verb)) for verb in self._verbs]

    def _sink(self, verb: str) -> Callable[[Any], object]:
        def take(item: Any) -> None:
            query = self._runtime.bus.open_query(item)
            if query is not None:
                self._runtime.post(lambda: self._answer(verb, query))

        return take

    @property
    def is_open(self) -> bool:
        """Whether a slot is granted."""
        return self._open

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Answer for as long as a slot is granted."""
        self._open = True
        try:
            yield
        finally:
            self._open = False

    def may_join(self, join: Join) -> bool:
        """Return whether a run may still join: one that was released only has not ended yet."""
        return (join.member, join.incarnation) not in self._released

    def _answer(self, verb: str, query: Query) -> None:
        if not self._open:
            _refuse(query, ControlCode.REFUSED, "members are admitted, released and succeeded in a slot only")
            return
        try:
            run = codec.decode(query.payload, ClockMember)
            self._runtime.fence.check(run.term)
        except BadMessage as error:
            _refuse(query, ControlCode.MALFORMED, str(error))
            return
        except ControlRefused as error:
            _refuse(query, error.code, str(error))
            return
        if verb == "release":
            self._released.add((run.member, run.incarnation))
        query.reply(codec.encode(Membership(self._verbs[verb](run))))


def _refuse(query: Query, code: ControlCode, problem: str) -> None:
    query.reply(codec.encode(ControlError(code, (problem,))), error=True)
