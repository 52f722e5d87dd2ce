"""Steps that the coordinator sends out, and the acknowledgements that come back."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from regraft.bus_schema.messages.protocol.clock import Ack, Frontier, Step, StepKind
from regraft.bus_schema.messages.protocol.control import ResentSample
from regraft.lockstep.clock_publisher import ClockPublisher
from regraft.lockstep.membership import Membership, MemberState
from regraft.lockstep.source_inbox import SourceInbox
from regraft.lockstep.step_links.source_links import SourceLinks
from regraft.patience import Patience
from regraft.runtime.runtime import Runtime

STEP_BOUND = 10.0
"""Seconds after which a silent member is dropped: slow is not hung, and a drop changes the run.

They last longer on a crowded machine, as all bounds of simulated time do.
"""
STEP_INTERVAL = 1.0
FORGETS_SLOWLY = 0.8
"""Share of a step's usual length that the last one does not change."""


@dataclass(slots=True)
class Moment:
    """The present simulated time, in nanoseconds since the start; a tick adds ``period``."""

    period: int
    time: int = 0

    @property
    def tick(self) -> int:
        """The number of the tick that ends at this time. It lasts until the next begins; before the first it is 0."""
        return max(0, (self.time - 1) // self.period)


class StepDispatcher:
    """The steps under way, by member; over ``links`` where there are some, else over the bus."""

    def __init__(
        self,
        membership: Membership,
        moment: Moment,
        publisher: ClockPublisher,
        runtime: Runtime,
        inbox: SourceInbox,
    ) -> None:
        self._membership = membership
        self._moment = moment
        self._publisher = publisher
        self._keys = runtime.keys
        self._name = runtime.assignment.name
        self._writers = runtime.writers
        self._inbox = inbox
        self._steps: dict[str, Step] = {}
        self._sent: dict[str, float] = {}
        self._takes: dict[str, float] = {}
        self._acks: dict[str, Ack] = {}
        self._welcomed_again: set[str] = set()
        self.links = SourceLinks(runtime, self.take_ack, self.send_again)

    def take_ack(self, ack: Ack) -> None:
        """Take an acknowledgement, if it answers the step that is under way."""
        step = self._steps.get(ack.member)
        if step is not None and ack.incarnation == step.incarnation and ack.number == step.number:
            self._acks[ack.member] = ack
            takes = time.monotonic() - self._sent[ack.member]
            self._takes[ack.member] = takes + FORGETS_SLOWLY * (self._takes.get(ack.member, takes) - takes)

    def awaits(self, name: str) -> bool:
        """Return whether a member's acknowledgement is waited for."""
        return name in self._steps and name not in self._acks

    def forget(self, name: str) -> None:
        """Wait for a member no longer."""
        self._steps.pop(name, None)
        self._acks.pop(name, None)

    def send(
        self,
        kinds: dict[str, StepKind],
        *,
        round_number: int = 0,
        outside: tuple[str, ...] = (),
        marks: dict[str, set[str]] | None = None,
    ) -> None:
        """Send each member its step: what it has to handle, or to mark, or whose messages enter from outside.

        All are waited for. So the slowest is sent its step first, and with it what it would wait for.
        """
        order = sorted(kinds, key=lambda name: self._takes.get(name, 0.0), reverse=True)
        for name in order:
            kind = kinds[name]
            member = self._membership.members[name]
            member.number += 1
            working = kind is StepKind.STEP
            gone = member.take_gone() if working else ()
            frontier = member.begin_step() if working else {}
            news = self._membership.news_of_wanted(member, self._membership.members[self._name]) if working else None
            wanted, source_reads = news or (None, ())
            hurried = name == order[0] and self.links.reaches(name, member.incarnation)
            step = Step(
                member.incarnation,
                member.number,
                kind,
                self._moment.tick,
                round_number,
                self._moment.time,
                frontier,
                gone,
                wanted,
                outside,
                tuple(sorted((marks or {}).get(name, ()))),
                member.take_ended() if working else (),
                self._own_samples(member, frontier) if hurried else {},
                source_reads,
            )
            self._steps[name] = step
            self._sent[name] = time.monotonic()
            # A link would overtake the repetition of a welcome, by which a member forgets all that it has read.
            in_order = name in self._welcomed_again
            self._welcomed_again.discard(name)
            if in_order or not self.links.send(name, step):
                self._publisher.put(self._keys.clock(f"step/{name}"), step)

    def _own_samples(self, member: MemberState, frontier: Frontier) -> dict[str, ResentSample]:
        """Return the newest that the source itself has put of what a member has to handle."""
        read = (key for key, sources in frontier.items() if self._name in sources and key not in member.on_demand)
        return self._writers.newest(read)

    def send_again(self, name: str) -> None:
        """Send a step over the bus that may have got lost, as with the member's link."""
        if not self.awaits(name):
            return
        if self._steps[name].kind is StepKind.WELCOME:
            self._welcomed_again.add(name)
        self._publisher.put(self._keys.clock(f"step/{name}"), self._steps[name])

    def collect(
        self, names: list[str], *, bounded: bool, ended: Callable[[], bool], late: Callable[[tuple[str, ...]], None]
    ) -> tuple[list[Ack], list[str]]:
        """Wait for the acknowledgements of ``names``, in any order.

        Steps are sent again after a while, and ``late`` is called with their members. Returns the acknowledgements in
        the order of names, and who stayed silent for too long (if ``bounded``); nobody is waited for once it has
        ``ended``.
        """
        again, within = time.monotonic(), Patience(STEP_BOUND)
        silent: list[str] = []
        while waiting := [name for name in names if name in self._steps and name not in self._acks]:
            now = time.monotonic()
            if ended():
                break
            if bounded and within.is_over():
                silent = waiting
                break
            if now - again > STEP_INTERVAL:
                again = now
                self._inbox.pump(0.0)  # this process may have stood still: answers may be there already
                late_ones = tuple(name for name in waiting if self.awaits(name))
                for name in late_ones:
                    self.send_again(name)
                late(late_ones)
            self._inbox.pump()
        answered = [name for name in names if name in self._steps and name in self._acks]
        acks = [self._acks[name] for name in answered]
        for name in answered:
            self.forget(name)
        return acks, silent
