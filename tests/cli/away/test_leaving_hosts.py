"""A host may leave after a command has seen it, and before it answers."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus_schema.keys import Keys
from regraft.cli.outcomes import Unreachable
from regraft.cli.topology import topology
from regraft.client import Client, HostSeen


class SeesThemLeave(Client):
    """Sees hosts of a bus as they are, just before all of them leave."""

    def __init__(self, *hosts: str) -> None:
        """Have these hosts be alive."""
        bus = MemoryBus(MemoryHub())
        self._tokens = [bus.announce(Keys("site").host(host, "alive")) for host in hosts]
        super().__init__(bus, "site")

    def hosts(self, wait: float = 2.0) -> dict[str, HostSeen]:
        """Return the hosts, which leave then."""
        found = super().hosts(wait)
        for token in self._tokens:
            token.close()
        return found


@pytest.fixture(params=[("edge",), ("arm", "edge")], ids=" ".join)
def joined_leave(request: pytest.FixtureRequest) -> Iterator[Client]:
    """Return a client of hosts that had joined."""
    with SeesThemLeave(*request.param) as client:
        yield client


def test_a_joined_host_that_leaves_meanwhile_stops_no_command(joined_leave: Client) -> None:
    assert "edge" in topology(joined_leave).hosts


def test_a_first_host_that_ends_meanwhile_leaves_the_system_unreachable() -> None:
    with SeesThemLeave("local", "edge") as client, pytest.raises(Unreachable, match="has just ended"):
        topology(client)
