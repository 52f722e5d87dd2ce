"""The members of the simulated clock, and what each has still to handle."""

from __future__ import annotations

from dataclasses import dataclass, field

from regraft.bus_schema.keys import matches
from regraft.bus_schema.messages.protocol.clock import Frontier, Wiring

Pair = tuple[str, str, str]
"""A connection: key, the member that writes it, the member that reads it."""

Wanted = tuple[tuple[str, ...], tuple[str, ...]]
"""The keys that a member has to write, and those of them that the source of time reads."""

MAX_BACKLOG = 32
"""Advances of its inputs after which a member is stepped although nothing wakes it: until then it holds the data."""


@dataclass(slots=True)
class MemberState:
    """The coordinator's record of one member. ``pending`` is what it has to handle in its next step.

    ``backlog`` counts the advances in it.
    """

    name: str
    incarnation: int
    inputs: dict[str, bool]
    outputs: set[str]
    on_demand: frozenset[str] = frozenset()
    next_wake: int | None = 0
    wants_slot: bool = False
    holds_time: bool = False
    due: bool = False
    number: int = 0
    pending: Frontier = field(default_factory=dict)
    backlog: int = 0
    outside: set[str] = field(default_factory=set)
    gone: set[str] = field(default_factory=set)
    ended: set[str] = field(default_factory=set)
    wanted: Wanted | None = None
    wanted_as_of: object = None

    def succeed(self, incarnation: int) -> None:
        """Be another run of the component, with all that this one still has to handle."""
        self.incarnation, self.wanted, self.wanted_as_of, self.holds_time = incarnation, None, None, False

    def begin_step(self) -> Frontier:
        """Return what is to be handled in the step that begins now; from here on, nothing is pending."""
        frontier, self.pending = self.pending, {}
        self.backlog, self.due = 0, False
        return frontier

    def drop(self, key: str, source: str) -> None:
        """Have nothing to handle any more of what a source put at a key."""
        sources = self.pending.get(key)
        if sources is not None:
            sources.pop(source, None)
            if not sources:
                del self.pending[key]

    def take_gone(self) -> tuple[str, ...]:
        """Return who left, for the step that begins now; whose last data is still to be handled is reported in the
        next.
        """
        if not self.gone:
            return ()
        handled_now = {source for sources in self.pending.values() for source in sources}
        gone, self.gone = self.gone - handled_now, self.gone & handled_now
        return tuple(sorted(gone))

    def take_ended(self) -> tuple[str, ...]:
        """Return whose run has ended, for the step that begins now."""
        if not self.ended:
            return ()
        ended, self.ended = self.ended, set()
        return tuple(sorted(ended))

    def wakes_on(self, key: str) -> bool | None:
        """Return whether new data at ``key`` wakes the member; None if it does not read the key."""
        found = self.inputs.get(key)
        if found is None:
            found = next(
                (wakes for pattern, wakes in self.inputs.items() if "*" in pattern and matches(pattern, key)), None
            )
        return found


class Membership:
    """All members, who is connected to whom, and how far every key has come.

    ``relayed`` are the keys that are read and to which all members contribute in their acknowledgements.
    """

    def __init__(self) -> None:
        self.members: dict[str, MemberState] = {}
        self.published: dict[str, dict[str, int]] = {}
        self.relayed: tuple[str, ...] = ()
        self.wired: set[Pair] = set()
        self._readers: dict[str, list[tuple[MemberState, bool]]] = {}
        self._changes = 0
        self._all_wired = True

    def add(self, name: str, incarnation: int, wiring: Wiring, next_wake: int | None) -> MemberState:
        """Its numbering continues, or its new epoch restarts it. To drop it now would drop its next samples."""
        for other in self.members.values():
            other.gone.discard(name)
        # The numbers that are still pending are those of the run before this one.
        self._drop_pending_of(name)
        on_demand = frozenset(wiring.on_demand)
        member = MemberState(name, incarnation, dict(wiring.inputs), set(wiring.outputs), on_demand, next_wake)
        self.members[name] = member
        for key, sequence in wiring.outputs.items():
            self.published.setdefault(key, {})[name] = sequence
        self._changed()
        self._all_wired = False
        return member

    def remove(self, name: str) -> None:
        """Forget a member that is lost: what others have not handled of it by now may never come."""
        self.leave(name)
        self._drop_pending_of(name)

    def _drop_pending_of(self, name: str) -> None:
        for member in self.members.values():
            for sources in member.pending.values():
                sources.pop(name, None)

    def leave(self, name: str) -> None:
        """Let a member go: what it published up to its last acknowledgement is still handled, and nothing beyond.

        Members that have replied to it get a step: they may pursue its goals, and have nothing else to do.
        """
        left = self.members.pop(name, None)
        replies = [key for key in left.inputs if "*" in key] if left is not None else []
        self.wired = {pair for pair in self.wired if name not in pair[1:]}
        for sources in self.published.values():
            sources.pop(name, None)
        for member in self.members.values():
            member.gone.add(name)
            member.ended.add(name)
            member.due = member.due or any(matches(key, written) for key in replies for written in member.outputs)
            for key in member.on_demand:  # nobody can make any more what has not been opened
                member.drop(key, name)
        self._changed()

    def rewire(self, member: MemberState, wiring: Wiring) -> None:
        """Take a member's new wiring."""
        left, subscribed = set(member.inputs) - set(wiring.inputs), member.on_demand.difference(wiring.on_demand)
        for key in {*wiring.anew, *left, *subscribed}:
            self.wired = {pair for pair in self.wired if not (pair[2] == member.name and matches(key, pair[0]))}
            member.pending = {k: sources for k, sources in member.pending.items() if not matches(key, k)}
        member.inputs, member.on_demand = dict(wiring.inputs), frozenset(wiring.on_demand)
        for key in member.outputs - set(wiring.outputs):
            self.wired = {pair for pair in self.wired if pair[:2] != (key, member.name)}
            self.published.get(key, {}).pop(member.name, None)
        for key, sequence in wiring.outputs.items():
            self.published.setdefault(key, {}).setdefault(member.name, sequence)
        member.outputs = set(wiring.outputs)
        self._changed()
        self._all_wired = False

    def _changed(self) -> None:
        self._readers.clear()
        self._changes += 1

    def unwired(self) -> set[Pair]:
        """Return the connections whose markers have not been seen yet; what is read on demand needs none."""
        if self._all_wired:
            return set()
        wanted = {
            (key, writer.name, reader.name)
            for writer in self.members.values()
            for key in writer.outputs
            for reader, _ in self.readers(key)
        }
        self.wired |= {pair for pair in wanted if pair[0] in self.members[pair[2]].on_demand}
        missing = wanted - self.wired
        self._all_wired = not missing
        return missing

    def confirm(self, pair: Pair, handled: int) -> None:
        """Take the news that a reader is wired to a writer, and what it still has to handle."""
        key, writer, reader = pair
        self.wired.add(pair)
        behind = self.published.get(key, {}).get(writer, 0)
        member = self.members[reader]
        if behind > handled:
            member.pending.setdefault(key, {})[writer] = behind
            member.due = member.due or bool(member.wakes_on(key))

    def readers(self, key: str) -> list[tuple[MemberState, bool]]:
        """Return who reads ``key``, and whether new data wakes them."""
        found = self._readers.get(key)
        if found is None:
            found = []
            for member in self.members.values():
                wakes = member.wakes_on(key)
                if wakes is not None:
                    found.append((member, wakes))
            self._readers[key] = found
        return found

    def advance(self, writer: MemberState, published: dict[str, int]) -> None:
        """Take what a member published in its step: it is pending for all who are wired to it.

        A key that the member writes for the first time (a request, a reply) needs no marker: it had a reader then.
        """
        for key, sequence in published.items():
            fresh = key not in writer.outputs
            if fresh:
                writer.outputs.add(key)
                self._changes += 1
            self.published.setdefault(key, {})[writer.name] = sequence
            for reader, wakes in self.readers(key):
                pair = (key, writer.name, reader.name)
                if fresh:
                    self.wired.add(pair)
                if pair in self.wired:
                    reader.pending.setdefault(key, {})[writer.name] = sequence
                    reader.backlog += 1
                    reader.due = reader.due or wakes or reader.backlog >= MAX_BACKLOG

    def news_of_wanted(self, member: MemberState, source: MemberState) -> Wanted | None:
        """Return the keys of a member's outputs that other members read, and those of the relayed topics.

        The second ones are those that the ``source`` subscribes to. None if they are those that were returned before.
        """
        as_of = (self._changes, self.relayed)
        if member.wanted_as_of == as_of:
            return None
        member.wanted_as_of = as_of
        read = [key for key in member.outputs if self.readers(key)]
        keys = tuple(sorted({*read, *self.relayed} if self.relayed else read))
        subscribed = (key for key in keys if source.wakes_on(key) is not None and key not in source.on_demand)
        wanted = (keys, tuple(subscribed))
        if wanted == member.wanted:
            return None
        member.wanted = wanted
        return wanted
