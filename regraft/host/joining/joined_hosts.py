"""The hosts that have joined the first one: who is there, who is silent, and who is lost for certain.

A joined host renews its lease by a sign of life now and then. It counts the lease from when it *sent* the last one that
was answered. The first host counts from when that *arrived*, and a little longer. So a host knows for a while that it
is alone before the first host counts it as lost. By then it has ended what may start elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from regraft.bus_schema.keys import host_name
from regraft.bus_schema.messages.protocol.control import ControlCode
from regraft.bus_schema.messages.protocol.host import (
    HostStatus,
    OtherHost,
    ProcessState,
    ProcessStatus,
    UpdateSpecs,
)
from regraft.bus_schema.messages.protocol.joining import PROTOCOL, JoinHost, Lease, RenewLease
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.bus_schema.model.hosts.offers import NO_OFFER, HostOffer, offer_problems
from regraft.host.host_publisher import Refused
from regraft.runtime.core.lease import now

SILENT_TIMEOUT = 1.0
"""Seconds without a sign of life after which a host is reported as silent; less if its link is closed."""
MARGIN = 1.0
"""Seconds that a host whose lease is over has for ending its components."""
LOOKED_AWAY = 0.3
"""Seconds between two looks above which the first host itself was held up: that is nobody else's silence."""
PRESENT = (HostState.JOINED, HostState.SILENT)


@dataclass(slots=True)
class _Other:
    state: HostState = HostState.ABSENT
    instance: str = ""
    pid: int = 0
    renewed: float = 0.0
    status: HostStatus | None = None
    ending: bool = False
    offer: HostOffer = NO_OFFER
    missed: set[str] = field(default_factory=set)
    """The components of updates that it may have missed: it gets them as it joins again."""
    told: set[str] = field(default_factory=set)
    """Those that an answer to its joining had: the answer may be lost as well, until its next sign of life."""


def _process(pid: int) -> str:
    """Return which process a host is, if it has reported it: one of another implementation need not."""
    return f" (process {pid})" if pid else ""


class JoinedHosts:
    """All hosts but the first. ``tell(kind, host, text)`` publishes events; ``lost(host)`` is called once for each
    loss.
    """

    def __init__(
        self,
        architecture: Callable[[], Architecture],
        tell: Callable[[str, str, str], object],
        lost: Callable[[str], object],
    ) -> None:
        """Nobody has joined; ``architecture`` returns the one in force."""
        self._architecture = architecture
        self._tell = tell
        self._lost = lost
        self._others: dict[str, _Other] = {}
        self._looked = now()

    # --- what they ask ---

    def check(self, asked: JoinHost) -> None:
        """Return whether a host may join; raises Refused, BadKey."""
        if asked.protocol != PROTOCOL:
            problem = f"speaks version {asked.protocol} of the protocol, this system {PROTOCOL}"
            raise Refused(f"host {asked.host!r} {problem}: install the same version of Regraft on both")
        host_name(asked.host)
        if asked.host == LOCAL:
            raise Refused(f"{LOCAL!r} is the name of a system's first host: choose another --name")
        problems = list(offer_problems(self._architecture(), asked.host, asked.offer))
        if problems:
            raise Refused("; ".join(problems))
        other = self._others.get(asked.host)
        if other is None or other.state not in PRESENT or other.instance == asked.instance:
            return
        if other.state is HostState.SILENT:
            left = max(0.0, other.renewed + self._lease(asked.host) + MARGIN - now())
            problem = f"a host {asked.host!r} is silent since a moment, and may still run: it counts as lost"
            raise Refused(f"{problem} in {left:.1f} s", ControlCode.TIMED_OUT)
        raise Refused(f"a host {asked.host!r} has joined already{_process(other.pid)}: choose another --name")

    def join(self, asked: JoinHost) -> tuple[str, ...]:
        """Take a host in that has been checked; returns the components of which it may have missed new specs."""
        other = self._others.setdefault(asked.host, _Other())
        back = other.instance == asked.instance
        other.state, other.instance, other.pid = HostState.JOINED, asked.instance, asked.pid
        other.renewed, other.status, other.offer = now(), None, asked.offer
        if back:
            self._tell("host.returned", asked.host, f"host {asked.host} is back")
        else:
            self._tell("host.joined", asked.host, f"host {asked.host} has joined{_process(asked.pid)}")
            other.missed.clear()
            other.told.clear()
        other.told |= other.missed
        other.missed.clear()
        return tuple(sorted(other.told))

    def knows(self, asked: RenewLease) -> bool:
        """Return whether a sign of life is one of a host that is part of the system."""
        other = self._others.get(asked.host)
        return other is not None and other.instance == asked.instance and other.state in PRESENT

    def renew(self, asked: RenewLease, ending: bool) -> Lease:
        """Take a sign of life; a host that is not known, was taken for lost or missed an update has to join again."""
        if not self.knows(asked):
            return Lease(held=False, ending=ending)
        other = self._others[asked.host]
        other.renewed = now()
        if asked.leaving:
            other.state, other.status = HostState.LEFT, None
            other.missed.clear()
            self._tell("host.left", asked.host, f"host {asked.host} has left")
        elif other.missed:
            return Lease(held=False, ending=ending)
        elif other.state is HostState.SILENT:
            other.state = HostState.JOINED
            self._tell("host.returned", asked.host, f"host {asked.host} answers again")
        other.told.clear()
        return Lease(held=True, ending=ending)

    def note(self, update: UpdateSpecs) -> None:
        """Note who did not get an update."""
        for host in self._others.keys() & set(update.not_told):
            if self._others[host].state in (*PRESENT, HostState.LOST):
                self._others[host].missed |= {*(spec.name for spec in update.specs), *update.removed}

    # --- what is seen of them ---

    def heard(self, status: HostStatus) -> None:
        """Note what a host states of its processes."""
        other = self._others.get(status.host)
        if other is not None and other.state in PRESENT:
            other.status = status

    def run_of(self, host: str, component: str) -> int | None:
        """Return the run of a component as a host that is there reports it, None if it reports none."""
        other = self._others.get(host)
        processes = other.status.processes if other and other.status and other.state in PRESENT else ()
        return next((process.incarnation for process in processes if process.component == component), None)

    def vanished(self, host: str) -> None:
        """Note that a host's link is closed: its process has ended, or the way to it is cut."""
        other = self._others.get(host)
        if other is not None and other.state is HostState.JOINED:
            self._fall_silent(host, other)

    def look(self) -> None:
        """Find who is silent, and who is lost."""
        present = now()
        if present - self._looked > LOOKED_AWAY:
            for other in self._others.values():
                other.renewed = min(present, other.renewed + present - self._looked)
        self._looked = present
        for host, other in self._others.items():
            silence = present - other.renewed
            if other.state is HostState.JOINED and silence > SILENT_TIMEOUT:
                self._fall_silent(host, other)
            if other.state is HostState.SILENT and silence > self._lease(host) + MARGIN:
                other.state = HostState.LOST
                self._tell("host.lost", host, f"host {host} is lost{self._with(host)}; {self._what_now(host)}")
                self._lost(host)

    def _fall_silent(self, host: str, other: _Other) -> None:
        other.state = HostState.SILENT
        other.missed |= other.told
        other.told.clear()
        self._tell("host.silent", host, f"host {host} gives no sign of life{self._with(host)}")

    def _with(self, host: str) -> str:
        names = self.placed(host)
        return f", and with it {', '.join(names)}" if names else ""

    def _what_now(self, host: str) -> str:
        target = self._architecture().rules(host).move_to
        if not self.placed(host):
            return "nothing of the system was on it"
        return f"its components are started on {target}" if target else "its components wait for its return"

    def _lease(self, host: str) -> float:
        return self._architecture().rules(host).lost_after

    def placed(self, host: str) -> list[str]:
        """Return the components that are to run on a host."""
        return [name for name, spec in sorted(self._architecture().components.items()) if spec.host == host]

    @property
    def lost(self) -> list[str]:
        """The hosts that are lost."""
        return [name for name, other in sorted(self._others.items()) if other.state is HostState.LOST]

    @property
    def present(self) -> bool:
        """Whether any other host is part of the system now, though it may be silent for a moment."""
        return any(other.state in PRESENT for other in self._others.values())

    def status(self) -> tuple[OtherHost, ...]:
        """Return all that the stack names or that have joined, with the processes of those that cannot report."""
        names = sorted({*self._architecture().hosts, *self._others} - {LOCAL})
        return tuple(self._status(name, self._others.get(name) or _Other()) for name in names)

    def _status(self, host: str, other: _Other) -> OtherHost:
        if other.state is HostState.JOINED:
            return OtherHost(host, other.state, offer=other.offer)
        known = {process.component: process for process in other.status.processes} if other.status else {}
        placed = [self._absent(name, known.get(name), other.state) for name in self.placed(host)]
        return OtherHost(host, other.state, tuple(placed), other.offer)

    def _absent(self, name: str, known: ProcessStatus | None, state: HostState) -> ProcessStatus:
        managed = self._architecture().components[name].managed
        waits = state in (HostState.ABSENT, HostState.LEFT)
        process = ProcessState.WAITING if waits else ProcessState.LOST
        incarnation, restarts = (known.incarnation, known.restarts) if known else (0, 0)
        end = {
            HostState.ABSENT: "its host has not joined",
            HostState.LEFT: "its host has left",
            HostState.SILENT: "its host gives no sign of life",
        }.get(state, "its host is lost")
        return ProcessStatus(name, incarnation, process, 0, restarts, 0.0, end, managed)

    def processes(self) -> tuple[ProcessStatus, ...]:
        """Return the processes of all other hosts, as far as they are known."""
        told = [other.status for other in self._others.values() if other.status and other.state is HostState.JOINED]
        found = {process.component: process for status in told for process in status.processes}
        found |= {process.component: process for other in self.status() for process in other.processes}
        return tuple(found.values())
