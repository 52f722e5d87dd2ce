"""Where walks are made: a system, with a second host if they need one, which may be killed on the way."""

from __future__ import annotations

from pathlib import Path

from regraft import run_directory
from regraft.bus_schema.model.hosts.host_state import HostState
from tests.failures.injecting import HOST_PID
from tests.failures.kinds import OF_TWO_HOSTS, STACK
from tests.failures.observing import settled
from tests.support.hosts import JoinedHost, wait_state
from tests.support.machine.processes import children_of, exists
from tests.support.systems import System
from tests.support.waiting import PATIENCE


class Place:
    """``folder`` of the run is where faults are prepared."""

    def __init__(self, folder: Path, *, hosts: int = 1) -> None:
        stack = folder / "stack.yaml"
        stack.write_text(STACK if hosts == 1 else OF_TWO_HOSTS)
        self._logs = folder
        self.guests: list[JoinedHost] = []
        self.system = System(stack)
        self.folder = run_directory.folder("tests")
        if hosts > 1:
            self._join()
        settled(self.system, *self.guests)

    def _join(self) -> None:
        guest = JoinedHost(self.system.info.endpoint, "edge", self._logs / "edge.log")
        guest.wait_joined(self.system)
        self.guests = [guest]
        (self.folder / HOST_PID).write_text(str(guest.process.pid))
        flags = run_directory.folder("tests@edge") / "flags"
        if not flags.is_symlink():
            flags.symlink_to(self.folder / "flags")

    def complete(self) -> None:
        """Wait for the end of the second host, which is being killed, and have it join again."""
        self.guests[0].process.wait(PATIENCE)
        wait_state(self.system, "edge", HostState.LOST)
        self._join()

    def end(self) -> None:
        """End it all, and see that nothing is left."""
        hosts = [self.system.process.pid, *(guest.process.pid for guest in self.guests)]
        processes = [pid for host in hosts for pid in children_of(host)]
        for guest in self.guests:
            guest.end()
        self.system.end()
        assert not [pid for pid in processes if exists(pid)]
