"""The first host of a system: the one that ``regraft up`` runs, and that others join."""

from __future__ import annotations

import time
from dataclasses import replace

from regraft.bus.interface import Bus, Presence, Sample
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.messages.protocol.host import LEAVE_OUT, HostStatus, OtherHost, UpdateSpecs
from regraft.bus_schema.messages.protocol.joining import (
    HostProof,
    JoinedSystem,
    JoinHost,
    Lease,
    PastRun,
    ProveHost,
    RenewLease,
)
from regraft.host.host import END_TIMEOUT, Host
from regraft.host.joining.failover import Failover
from regraft.host.joining.joined_hosts import JoinedHosts
from regraft.host.joining.proof_checker import ProofChecker
from regraft.host.plan import HostPlan
from regraft.host.runs.run_history import RunHistory
from regraft.host.system_topics import HostSystemTopics
from regraft.host.watchdog.process_killer import LOOK_INTERVAL
from regraft.host.zygote.zygote import Zygote
from regraft.runtime.core.clock import RealClock
from regraft.stack.installed import packages


class PrimaryHost(Host):
    """A host that knows of the others."""

    def __init__(self, plan: HostPlan, bus: Bus, zygote: Zygote, witness: ProofChecker) -> None:
        super().__init__(plan, bus, zygote)
        self._rescue = Failover(bus, plan.architecture.system, self._tell_later)
        self.others = JoinedHosts(lambda: self.plan.architecture, self._tell, self._lost)
        self._asked_for: dict[str, set[str]] = {}
        self._witness = witness
        self.questions.verbs |= {"prove": self._prove, "join": self._join, "renew": self._renew}
        self._ending = False
        clock, post = RealClock(), self.lazy.append
        self._system = HostSystemTopics(bus, self._keys, plan.name, clock, post, self._reported_run)

    def start(self) -> None:
        """Appear on the bus, and start everything that is placed here."""
        if not self.plan.architecture.simulated:
            self.faults.start(time.monotonic())
        super().start()
        status, alive = self._keys.host("*", "status"), self._keys.host("*", "alive")
        self._declared += [
            self._bus.subscribe(status, self.lazy.append),
            self._bus.watch(alive, lambda presence: self.inbox.put(lambda: self._presence(presence))),
        ]

    def end(self) -> None:
        """End every process here, and have the other hosts end theirs."""
        self._ending = True
        super().end()
        deadline = time.monotonic() + END_TIMEOUT
        while self.others.present and time.monotonic() < deadline:
            self.pump(LOOK_INTERVAL)
        self._system.close()

    def others_status(self) -> tuple[OtherHost, ...]:
        """Return how the host sees the others."""
        return self.others.status()

    def take_update(self, update: UpdateSpecs) -> None:
        """Take new specs as any host, and note who may not get them."""
        super().take_update(update)
        self.others.note(update)
        if update.specs:  # an undo may put components back on a host that has been lost since
            for host in self.others.lost:
                self._lost(host)

    def _look(self) -> None:
        super()._look()
        self.others.look()
        self.faults.look(time.monotonic())
        if not self.plan.architecture.simulated:
            self._system.see(self.plan.architecture)
            self._system.publish()

    def _reported_run(self, name: str) -> int | None:
        """Return the run of a component that its host reports, None for none."""
        spec = self.plan.architecture.components.get(name)
        if spec is not None and spec.host != self.plan.name:
            return self.others.run_of(spec.host, name)
        return self.processes[name].incarnation if name in self.processes else None

    def _tell(self, kind: str, host: str, text: str) -> None:
        self._next_status = 0.0
        self._publisher.event(kind, host, text)

    def _tell_later(self, kind: str, host: str, text: str) -> None:
        """Report from another thread: only the host's own one may put anything."""
        self.inbox.put(lambda: self._tell(kind, host, text))

    def _lost(self, host: str) -> None:
        target = self.plan.architecture.rules(host).move_to
        asked_for = self._asked_for.setdefault(host, set())
        names = [name for name in self.others.placed(host) if name not in asked_for]
        if target and names and not self._ending:
            asked_for.update(names)  # a start that fails is not asked for without end
            self._rescue.begin(host, target, names)

    def _presence(self, presence: Presence) -> None:
        if not presence.present:
            self.others.vanished(presence.key.split("/")[-2])

    def _take_sample(self, sample: Sample) -> None:
        parts = sample.key.split("/")
        if parts[1] != "host":
            super()._take_sample(sample)
        elif parts[2] != self.plan.name:
            try:
                self.others.heard(codec.decode(sample.payload, HostStatus))
            except SchemaError as error:
                self._log.warning("%s: %s", sample.key, error)

    # --- what other hosts ask ---

    def _prove(self, payload: bytes) -> HostProof:
        return self._witness.prove(codec.decode(payload, ProveHost))

    def _join(self, payload: bytes) -> JoinedSystem:
        asked = codec.decode(payload, JoinHost)
        changed: tuple[str, ...] = ()
        self.others.check(asked)
        if asked.instance:
            self._witness.check(asked)
            changed = self.others.join(asked)
            self._asked_for.pop(asked.host, None)
            self._rescue.withdraw(asked.host)
        plan = self.plan
        return JoinedSystem(
            plan.run,
            self.revision,
            self.term,
            plan.architecture,
            plan.seed,
            plan.source or "",
            str(plan.folder),
            str(plan.stack_folder.resolve()),
            plan.architecture.rules(asked.host).lost_after,
            tuple(_further(self.past, name) for name in self.others.placed(asked.host)),
            by_certificate=self._witness.wanted,
            references=plan.references,
            packages=packages(),
            changed=changed,
            folders=tuple(map(str, plan.folders)),
        )

    def _renew(self, payload: bytes) -> Lease:
        asked = codec.decode(payload, RenewLease)
        if self.others.knows(asked):
            self._witness.check(asked)
        return self.others.renew(asked, self._ending)


def _further(past: RunHistory, component: str) -> PastRun:
    run = past.of(component)
    return replace(run, incarnation=run.incarnation + LEAVE_OUT) if run.incarnation else run
