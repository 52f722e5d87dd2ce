"""A host that has joined another: it runs what the architecture places on it, for as long as it belongs to the system.

It proves that it is there by renewing its lease. Once that has run out, it is alone: what may then start elsewhere it
ends at once, so that two runs of a component never act. When it is heard again, it asks again what to run.
"""

from __future__ import annotations

import math
import signal
from dataclasses import replace

from regraft.bus.interface import Answer, Bus, BusError
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.control import ControlCode, ControlError
from regraft.bus_schema.messages.protocol.host import StartComponent, UpdateSpecs
from regraft.bus_schema.messages.protocol.joining import JoinedSystem, JoinHost, Lease, PastRun, RenewLease
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.bus_schema.model.hosts.offers import HostOffer
from regraft.host.host import Host
from regraft.host.joining.leaving import ANSWER_TIMEOUT, ATTEMPTS, announce
from regraft.host.plan import HostPlan
from regraft.host.runs.managed_process import ManagedProcess
from regraft.host.runs.starting_checkpoint import StartingCheckpoint
from regraft.host.zygote.zygote import Zygote
from regraft.runtime.core.lease import GRACE, GrantedLease, now
from regraft.security.host_proof import Seal

RENEW_INTERVAL = 0.2
GRACE_TO_BEGIN_AGAIN = 1.0
"""Seconds that a run may take to end before it begins again by another spec."""
PATIENCE = 60.0
"""Seconds without the first host after which a host gives up: it ends its components, and itself."""


class JoinedHost(Host):
    """A joined host. ``over`` states why it has to end, empty while it has not to."""

    def __init__(
        self,
        plan: HostPlan,
        bus: Bus,
        zygote: Zygote,
        joined: JoinedSystem,
        asked_at: float,
        instance: str,
        seal: Seal,
        offer: HostOffer,
    ) -> None:
        """It has just joined, as was ``asked_at`` (s, of the leases' clock); nothing runs yet."""
        super().__init__(plan, bus, zygote)
        self.over = ""
        self.orderly = self.failed = False
        self.term, self.revision = joined.term, joined.revision
        self._instance = instance
        self._seal = seal
        self._offer = offer
        self._lease = joined.lease
        self._held_until = asked_at + joined.lease
        self._lapsed = self._outside = False
        self._asked_at = self._updated_at = 0.0
        self._waiting = False
        self._cut: set[str] = set()
        self._leases: dict[str, GrantedLease] = {}
        for run in joined.past:
            self._take_past(run)

    def _take_past(self, run: PastRun) -> None:
        managed = self.processes.get(run.component)
        self.standby_runs.leave_out(run.component, run.incarnation)
        self.past.note(run.component, run.incarnation, StartingCheckpoint(run.checkpoint, run.incarnation))
        if managed is not None and not managed.has_process and run.incarnation > managed.incarnation:
            managed.incarnation = run.incarnation
            managed.checkpoint.resume(run.checkpoint)

    def pump(self, timeout: float) -> None:
        """See to the lease, then do as any host."""
        self._see_to_lease()
        self._extend_leases()
        super().pump(timeout)

    def end(self) -> None:
        """End every process, and announce that it leaves: in good order, nobody takes over what it ran."""
        in_order = not (self.ended or self.failed)
        super().end()
        if not in_order:
            return
        try:
            announce(self._bus, self._keys, lambda: self._sign(leaving=True), 1 if self.over else ATTEMPTS)
        except BusError as error:
            self._log.warning("%s", error)

    # --- the lease ---

    def lease_of(self, managed: ManagedProcess) -> str:
        """Return the path of a component's own lease: this host may be frozen when it should end it."""
        name = managed.spec.name
        if name not in self._leases:
            self._leases[name] = GrantedLease(name, self._until(name))
        return self._leases[name].path

    def _until(self, name: str) -> float:
        """Return until when a component may act: for ever, if nobody would start it elsewhere."""
        may_start_elsewhere = (
            self.plan.architecture.rules(self.plan.name).move_to
            or name not in self.processes
            or self._is_handed_over(name)
        )
        return self._held_until + GRACE if may_start_elsewhere else math.inf

    def _extend_leases(self) -> None:
        for name in self._leases.keys() - {managed.spec.name for managed in self.all_processes()}:
            self._leases.pop(name).close()
        for name, lease in self._leases.items():
            lease.extend(self._until(name))

    def _sign(self, *, leaving: bool = False) -> RenewLease:
        return self._seal.on(RenewLease(self.plan.name, self._instance, leaving))

    def _see_to_lease(self) -> None:
        present = now()
        if present > self._held_until:
            self._lapse()
        if present > self._held_until + PATIENCE and not self.over:
            self.over = f"the first host has not been heard of for {PATIENCE + self._lease:g} s"
        due = present - self._asked_at > (ANSWER_TIMEOUT if self._waiting else RENEW_INTERVAL)
        if due and not self.ended and not self.over:
            self._asked_at, self._waiting = present, True
            self._ask(present)

    def _ask(self, sent: float) -> None:
        # A lease that has run out is not renewed: much may have been decided meanwhile.
        outside = self._outside or self._lapsed
        asked = self._seal.on(JoinHost(self.plan.name, self._instance, offer=self._offer)) if outside else self._sign()
        verb = "join" if outside else "renew"

        def done(answers: list[Answer]) -> None:
            self.inbox.put(lambda: self._told(answers, sent))

        try:
            self._bus.ask(self._keys.host(LOCAL, verb), codec.encode(asked), ANSWER_TIMEOUT, done)
        except BusError as error:
            self._log.warning("%s", error)

    def _told(self, answers: list[Answer], sent: float) -> None:
        if sent == self._asked_at:
            self._waiting = False
        if not answers or self.ended or self.over:
            return
        try:
            if answers[0].error:
                self._take_refusal(codec.decode(answers[0].payload, ControlError))
            elif answers[0].key.endswith("/renew"):
                self._take_lease(codec.decode(answers[0].payload, Lease), sent)
            else:
                self._take_system(codec.decode(answers[0].payload, JoinedSystem), sent)
        except BadMessage as error:
            self._log.warning("the first host: %s", error)

    def _take_refusal(self, error: ControlError) -> None:
        if error.code is ControlCode.REFUSED:
            self.over = "; ".join(error.problems)

    def _take_lease(self, lease: Lease, sent: float) -> None:
        if lease.ending:
            self.over, self.orderly = "the system ends", True
        elif not lease.held:
            self._outside, self._asked_at = True, 0.0  # to join again is urgent: the lease is not extended meanwhile
        elif not self._lapsed:
            self._held_until = sent + self._lease

    def _lapse(self) -> None:
        """Nobody can rely on this host any more: end what may be started elsewhere."""
        if self._lapsed:
            return
        self._lapsed = True
        rules = self.plan.architecture.rules(self.plan.name)
        living = [
            name
            for name, managed in sorted(self.processes.items())
            if managed.has_process or managed.start_at is not None
        ]
        names = [name for name in living if rules.move_to or self._is_handed_over(name)]
        ended = sorted({*names, *self.standby_runs.processes})
        what = f"ends {', '.join(ended)}" if ended else "continues alone"
        self._publisher.event(
            "host.alone", self.plan.name, f"host {self.plan.name} hears nothing of the system: it {what}"
        )
        for name in names:
            self._cut_off(self.processes[name])
            self._cut.add(name)
        self._end_beside()

    def _is_handed_over(self, name: str) -> bool:
        """Return whether a component is being moved, from here or to here: it may continue elsewhere, by any
        rules.
        """
        return self.processes[name].awaited or self._is_elsewhere(name)

    def _end_beside(self) -> None:
        """End what runs next to components: a decision about it may never come."""
        for managed in list(self.standby_runs.processes.values()):
            self._cut_off(managed)

    def _cut_off(self, managed: ManagedProcess) -> None:
        """End a component's process at once, without a graceful shutdown."""
        managed.why_killed = "its host was cut off"
        self.ask_to_end(managed, 0.0)
        if managed.pid:
            self._zygote.signal(managed.pid, signal.SIGKILL)

    # --- joining again ---

    def _take_system(self, joined: JoinedSystem, sent: float) -> None:
        if joined.run != self.plan.run:
            self.over = "the system that this host had joined has ended"
            return
        if self._updated_at > sent:
            return  # the answer may be older than what has been given since: it is asked again
        was_alone = self._lapsed
        self._held_until, self._lease = sent + joined.lease, joined.lease
        self._lapsed = self._outside = False
        self.term, self.revision = max(self.term, joined.term), joined.revision
        self.plan = replace(self.plan, architecture=joined.architecture)
        mine = self.plan.mine()
        new = mine.keys() - self.processes.keys()
        # Of a host that was never alone, nothing was decided that its manager does not see to: moves are under way. But
        # a removal may have been undone that it had carried out, while it was silent again.
        to_start = self._cut | new if was_alone else (new & set(joined.changed)) - self.standby_runs.processes.keys()
        placed = mine.keys() if was_alone else joined.architecture.components.keys()
        for name in sorted(self.processes.keys() - placed):
            # It is placed elsewhere now, or nowhere: the run here does not speak for it any more.
            self.processes[name].remove()
            self._cut_off(self.processes[name])
        if was_alone:
            self._end_beside()
        for spec in mine.values():
            self._take_spec(spec)
        for run in joined.past:
            self._take_past(run)
        for name in sorted(mine.keys() & set(joined.changed) - to_start):
            self._begin_again(name)
        for name in sorted(to_start & mine.keys()):
            self.questions.start(codec.encode(StartComponent(name, term=self.term)))
        self._cut.clear()
        self._publisher.event("host.returned", self.plan.name, f"host {self.plan.name} is part of the system again")
        self._next_status = 0.0

    def take_update(self, update: UpdateSpecs) -> None:
        """Take new specs as any host."""
        super().take_update(update)
        if update.specs or update.removed:
            self._updated_at = now()

    def _begin_again(self, name: str) -> None:
        """Have a component run by its spec: nobody knows what its run was given meanwhile."""
        managed = self.processes.get(name)
        if managed is not None and managed.has_process and not managed.stopping:
            self.ask_to_end(managed, GRACE_TO_BEGIN_AGAIN)
            managed.start_again = True
