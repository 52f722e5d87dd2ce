"""A component that acts on a host which is frozen or cut off, and what it wrote down."""

from __future__ import annotations

import random
from pathlib import Path

from regraft.bus_schema.model.adaptation import Move, Outcome
from regraft.bus_schema.model.hosts.host_state import HostState
from tests.host.several import MOVE, Site
from tests.support.hosts import JoinedHost, wait_state
from tests.support.machine.processes import children_of, go_on, stop
from tests.support.waiting import wait_until

TIMES = 13
"""Attacks of one test."""
ACTOR = "  actor: {class: 'tests.attack.parts:Actor', host: edge, connect: {ticks: ticks}, parameters: {acts: FILE}}\n"
LATEST = 0.3
"""Seconds after which an attack begins at the latest, once all is well."""


def _overlaps(acts: Path) -> list[str]:
    """Return the changes from a process that acts to one that has acted before: the runs were mixed."""
    seen: list[str] = []
    mixed = []
    for line in acts.read_text().splitlines():
        pid = line.split()[0]
        if seen and pid == seen[-1]:
            continue
        if pid in seen:
            mixed.append(line)
        seen.append(pid)
    return mixed


class Attacked:
    """A component that acts on a host which is frozen or cut off, and starts elsewhere."""

    def __init__(self, site: Site, folder: Path, chance: random.Random) -> None:
        self.site, self.chance, self.acts = site, chance, folder / "acts"
        site.up(ACTOR.replace("FILE", str(self.acts)), MOVE)
        self.link = site.link()
        self.guest: JoinedHost = site.join("edge", self.link.endpoint)
        self.run = site.wait_active("actor")

    def freeze(self, everything: bool) -> None:
        """Freeze the host, perhaps with all that it runs, until its component acts elsewhere."""
        self._wait_a_moment()
        below = children_of(self.guest.process.pid) if everything else []
        frozen = self.chance.sample([self.guest.process.pid, *below], 1 + len(below))
        for pid in frozen:
            stop(pid)
        self._acts_elsewhere()
        for pid in self.chance.sample(frozen, len(frozen)):
            go_on(pid)
        self._comes_back()

    def cut(self) -> None:
        """Cut its link until its component acts elsewhere."""
        self._wait_a_moment()
        self.link.cut()
        self._acts_elsewhere()
        self.link.heal()
        self._comes_back()

    def _wait_a_moment(self) -> None:
        count, more = self._written(), self.chance.randint(1, int(LATEST * 100))
        wait_until(lambda: self._written() >= count + more, "some more acts")

    def _written(self) -> int:
        return len(self.acts.read_bytes().splitlines()) if self.acts.exists() else 0

    def _acts_elsewhere(self) -> None:
        self.run = self.site.wait_active("actor", self.run)
        assert self.site.host_of("actor") == "local"
        self._wait_a_moment()

    def _comes_back(self) -> None:
        wait_state(self.site.system, "edge", HostState.JOINED)
        self._wait_a_moment()
        report = self.site.adapt(Move("actor", "edge"))
        assert report.outcome is Outcome.APPLIED, report
        wait_until(lambda: self.site.host_of("actor") == "edge", "it to be back")
        self.run = self.site.wait_active("actor", self.run)
        assert _overlaps(self.acts) == []
