"""A system of several hosts for the tests."""

from __future__ import annotations

from pathlib import Path

from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.bus_schema.messages.protocol.control import Snapshot
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest
from regraft.bus_schema.model.lifecycle import State
from tests.support.hosts import JoinedHost
from tests.support.links import Link
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

STACK = """\
system: tests
imports: [tests.host.parts]
hosts: HOSTS
topics:
  ticks: {type: host_tests/Tick}
  pulses: {type: host_tests/Tick}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite, answer_within: 1.0, undo_within: 3.0, start_within: 20.0}
"""
TICKER = "  ticker: {class: 'tests.host.parts:Ticker', host: edge}\n"
WAIT = "[edge, arm]"
MOVE = "{edge: {when_lost: {move_to: local}, lost_after: 1.5}}"


class Site:
    """A system and the hosts that join it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.guests: list[JoinedHost] = []
        self.links: list[Link] = []
        self.system: System

    def up(self, components: str = TICKER, hosts: str = WAIT, *options: str) -> System:
        """Start the first host."""
        stack = self.folder / "stack.yaml"
        stack.write_text(STACK.replace("HOSTS", hosts) + components)
        self.system = System(stack, *options)
        return self.system

    def join(self, name: str = "edge", endpoint: str = "", *options: str) -> JoinedHost:
        """Have a further host join, and wait until it has."""
        guest = self.begin(name, endpoint, *options)
        guest.wait_joined(self.system)
        return guest

    def begin(self, name: str, endpoint: str = "", *options: str) -> JoinedHost:
        """Have a further host try to join."""
        log = self.folder / f"{name}-{len(self.guests)}.log"
        guest = JoinedHost(endpoint or self.system.info.endpoint, name, log, *options)
        self.guests.append(guest)
        return guest

    def link(self) -> Link:
        """Return a link to the first host that can be cut."""
        self.links.append(Link(self.system.info.endpoint))
        return self.links[-1]

    def process(self, name: str, host: str) -> object:
        """Return a component's process if it is that host's."""
        seen = self.system.client.hosts().get(host)
        return next((p for p in seen.processes if p.component == name), None) if seen else None

    def snapshot(self, name: str) -> dict[str, int]:
        """Return the state that a component would save."""
        snapshot = self.system.client.control(name, "state")
        assert isinstance(snapshot, Snapshot)
        state: dict[str, int] = snapshot.state
        return state

    def wait_active(self, name: str, beyond: int = 0) -> int:
        """Wait until a later run of a component is active; returns its incarnation."""

        def active() -> bool:
            seen = self.system.client.components().get(name)
            status = seen.status if seen and seen.alive else None
            return bool(status and status.state is State.ACTIVE and status.incarnation > beyond)

        wait_until(active, f"{name} to be active")
        status = self.system.client.components()[name].status
        assert status is not None
        return status.incarnation

    def pid(self, name: str) -> int:
        """Return the process of a component."""

        def told() -> int:
            process = self.system.client.components()[name].process
            return process.pid if process else 0

        wait_until(told, f"the process of {name}")
        return told()

    def host_of(self, name: str) -> str | None:
        """Return where a component runs, as reported of the run that is alive."""

        def reported() -> bool:
            seen = self.system.client.components()[name]
            of = seen.process.incarnation if seen.process else None
            return not seen.alive or (seen.status is not None and of == seen.status.incarnation)

        wait_until(reported, f"a host to report {name}")
        return self.system.client.components()[name].host

    def adapt(self, *changes: object) -> AdaptationReport:
        """Have the system adapted."""
        request = AdaptationRequest(changes)  # type: ignore[arg-type]
        return self.system.client.call("adaptation_manager/adapt", request, AdaptationReport, PATIENCE)

    def journal(self) -> list[AdaptationReport]:
        """Return the journal, newest first."""
        page = self.system.client.call("adaptation_manager/journal", JournalRequest(), JournalPage, PATIENCE)
        return list(page.entries)

    def close(self) -> None:
        """End everything."""
        for link in self.links:
            link.heal()
        for guest in self.guests:
            guest.end()
        self.system.end()
        for link in self.links:
            link.close()
