"""A bus of either kind, for the components of one test."""

from __future__ import annotations

from regraft.bus.interface import Bus
from regraft.bus.memory_bus import MemoryBus, MemoryHub
from regraft.bus.zenoh_bus import ZenohBus, open_bus
from regraft.bus.zenoh_config import Endpoints
from tests.support.machine.ports import free_endpoint


class Buses:
    """A bus in memory, or Zenoh with a router in this process, and the sessions on it."""

    def __init__(self, kind: str, *, lockstep: bool = False) -> None:
        """Open a bus: ``kind`` is "memory" or "zenoh"."""
        self._lockstep = lockstep
        self._hub = MemoryHub() if kind == "memory" else None
        self._router: ZenohBus | None = None
        self._sessions: list[Bus] = []
        self.endpoint = ""
        if kind == "zenoh":
            self.endpoint = free_endpoint()
            self._router = open_bus(Endpoints(listen=(self.endpoint,), router=True), lockstep=lockstep)

    def session(self) -> Bus:
        """Open another session."""
        bus: Bus
        if self._hub:
            bus = MemoryBus(self._hub)
        else:
            bus = open_bus(Endpoints(connect=(self.endpoint,)), lockstep=self._lockstep)
        self._sessions.append(bus)
        return bus

    def close(self) -> None:
        """Close all sessions, and the router."""
        for session in self._sessions:
            session.close()
        if self._router:
            self._router.close()
