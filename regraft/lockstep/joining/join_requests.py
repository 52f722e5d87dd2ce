"""The runs that have asked to join the clock and wait for their turn."""

from __future__ import annotations

from collections.abc import Callable

from regraft.bus.known_runs import Run
from regraft.bus_schema.messages.protocol.clock import ClockMember, Join
from regraft.lockstep.joining.liveness import LivenessTracker
from regraft.lockstep.membership import Membership


class JoinRequests:
    """At most one request of each component: that of its newest run, if that lives and no member's run still does.

    ``may_join`` returns whether a run may still join.
    """

    def __init__(self, membership: Membership, may_join: Callable[[Join], bool]) -> None:
        self.pending: dict[str, Join] = {}
        self._membership = membership
        self._may_join = may_join
        self._living = LivenessTracker()

    def take(self, join: Join) -> None:
        """Take a request; one that comes too early is kept until its time."""
        member = self._membership.members.get(join.member)
        waiting = self.pending.get(join.member)
        if (
            not self._may_join(join)
            or not self._living.admits(join, [run.incarnation for run in (member, waiting) if run is not None])
            or (waiting is not None and join.incarnation < waiting.incarnation)
        ):
            return
        if member is None or join.incarnation > member.incarnation:
            self.pending[join.member] = join

    def appeared(self, run: Run) -> None:
        """Note that a run lives."""
        early = self._living.appeared(run)
        if early is not None:
            self.take(early)

    def vanished(self, run: Run) -> list[Join]:
        """Note that a run has ended; returns the requests that waited for that, to be taken once it is no member."""
        self.drop(ClockMember(*run))
        return self._living.vanished(run)

    def drop(self, run: ClockMember) -> None:
        """Forget the request of a run."""
        if self.asks(run):
            del self.pending[run.member]

    def asks(self, run: ClockMember) -> bool:
        """Return whether the request of exactly this run waits."""
        join = self.pending.get(run.member)
        return join is not None and join.incarnation == run.incarnation

    def lives(self, run: ClockMember) -> bool:
        """Return whether a run lives."""
        return self._living.has((run.member, run.incarnation))

    def expect(self, run: ClockMember) -> None:
        """Let a run's early request wait for its turn now, although an older run of its component lives."""
        waiting = self._living.waiting((run.member, run.incarnation))
        if waiting is not None:
            self.pending[run.member] = waiting
