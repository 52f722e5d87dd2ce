"""Further hosts, as a user starts them."""

from __future__ import annotations

from pathlib import Path

from regraft.bus_schema.model.hosts.host_state import HostState
from tests.support.commands import Command
from tests.support.systems import System
from tests.support.waiting import wait_until


class JoinedHost(Command):
    """``regraft host --join`` in a process of its own."""

    def __init__(self, endpoint: str, name: str, log: Path, *options: str) -> None:
        self.name = name
        super().__init__("host", "--join", endpoint, "--name", name, *options, log=log)

    def wait_joined(self, system: System) -> None:
        """Wait until the first host has taken it in, and knows what it runs."""

        def joined() -> bool:
            self.must_run()
            return state_of(system, self.name) is HostState.JOINED

        wait_until(joined, f"{self.name} to join")


def state_of(system: System, host: str) -> HostState | None:
    """Return how the first host sees another."""
    seen = system.client.hosts().get(host)
    return seen.state if seen else None


def wait_state(system: System, host: str, state: HostState) -> None:
    """Wait until the first host sees another so."""
    wait_until(lambda: state_of(system, host) is state, f"{host} to be {state.value}")
