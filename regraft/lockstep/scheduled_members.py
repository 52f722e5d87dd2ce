"""The members of the clock, as a schedule of faults sees them: they end and come back between two ticks."""

from __future__ import annotations

from collections.abc import Callable

from regraft.bus_schema.messages.management.system import SystemFaultKind
from regraft.bus_schema.messages.protocol.faults import FaultInjected
from regraft.bus_schema.model.scheduled_faults import FaultKind, ScheduledFault
from regraft.lockstep.joining.join_requests import JoinRequests
from regraft.lockstep.membership import Membership
from regraft.lockstep.system_relay import SystemRelay
from regraft.runtime.runtime import Runtime


class ScheduledMembers:
    """The coordinator's members; ``forget`` is called with one that is none any more."""

    def __init__(
        self,
        runtime: Runtime,
        membership: Membership,
        joins: JoinRequests,
        system: SystemRelay,
        forget: Callable[[str], None],
    ) -> None:
        self._runtime = runtime
        self._membership = membership
        self._joins = joins
        self._system = system
        self._forget = forget

    def lives(self, name: str) -> int | None:
        """Return the incarnation of a member, None if it is none."""
        member = self._membership.members.get(name)
        return None if member is None else member.incarnation

    def has_asked(self, name: str, above: int) -> bool:
        """Return whether a run later than ``above`` has asked to join, or has joined."""
        join = self._joins.pending.get(name)
        return (join.incarnation if join else self.lives(name) or 0) > above

    def end(self, injected: FaultInjected, fault: ScheduledFault) -> None:
        """Let a member go whose run has ended as scheduled: in every run it goes between the same two ticks."""
        name = injected.component
        if self.lives(name) is not None:
            self._membership.remove(name)
            self._forget(name)
            self._system.ended(name, injected.incarnation, _kind(injected, fault), _reason(fault))
        self._runtime.reporter.event("clock.left", f"{name} left the clock as scheduled: {injected.ended}")


def _kind(injected: FaultInjected, fault: ScheduledFault) -> SystemFaultKind:
    if injected.quarantined:
        return SystemFaultKind.QUARANTINED
    return SystemFaultKind.DIED if fault.kind is FaultKind.KILL else SystemFaultKind.HUNG


def _reason(fault: ScheduledFault) -> str:
    """Return why a run has ended, the same in every run: the host's reason depends on when it looked."""
    return "killed by SIGKILL" if fault.kind is FaultKind.KILL else "killed: its loop hung"
