"""A component that measures the processor time of its whole system, between two moments of simulated time."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from regraft import Component, every
from regraft.process.descendants import descendants

METER = "REGRAFT_BENCH_METER"
"""The environment variable that names the file of the samples; the system's processes alone have it."""
PART = 3.0
"""Simulated seconds between two samples: a whole number of the detector's and the qualities' periods."""
TICKS = os.sysconf("SC_CLK_TCK")


class ProcessorMeter(Component):
    """Writes a line with the simulated time and the seconds of all processes' work, now and then."""

    def on_configure(self) -> None:
        """Find the process that has started the system."""
        self._root = _root()

    @every(seconds=PART)
    async def sample(self) -> None:
        """Take a sample while nothing else runs."""
        async with self.kit.exclusive():
            used = sum(map(processor_seconds, (self._root, *descendants(self._root))))
        with Path(os.environ[METER]).open("a") as file:
            file.write(f"{self.kit.now()} {used}\n")


def processor_seconds(pid: int) -> float:
    """Return the seconds that all threads of a process have worked, by the kernel's finest count; 0 if it has ended."""
    with contextlib.suppress(OSError):
        spent = [Path(f"/proc/{pid}/task/{thread}/schedstat") for thread in os.listdir(f"/proc/{pid}/task")]
        if all(file.exists() for file in spent):
            return sum(int(file.read_text().split()[0]) for file in spent) / 1e9
        user, system = Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].split()[11:13]
        return (int(user) + int(system)) / TICKS
    return 0.0


def _root() -> int:
    """Return the outermost process around this one that has the variable."""
    pid = os.getpid()
    while (parent := _parent(pid)) > 1 and _is_of_system(parent):
        pid = parent
    return pid


def _parent(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].split()[1])


def _is_of_system(pid: int) -> bool:
    with contextlib.suppress(OSError):
        return f"{METER}=".encode() in Path(f"/proc/{pid}/environ").read_bytes()
    return False
