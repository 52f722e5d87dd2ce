"""A process with everything imported, forked into components: what a host's zygote is, without a host."""

from __future__ import annotations

import importlib
import os
import signal
import struct
import subprocess
import sys
from typing import IO

from regraft.bus_schema.encoding import codec
from regraft.process.forked import die_with_parent
from regraft.process.main import run_component
from regraft.runtime.core.assignment import Assignment
from tests.support.paths import ROOT

LENGTH = struct.Struct("<I")


class Nursery:
    """The test's end."""

    def __init__(self, *modules: str) -> None:
        """Begin it; it imports ``modules``, where the components' classes are, once for all."""
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.support.nursery", *modules],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
        )

    def start(self, assignment: Assignment) -> int:
        """Fork a component; returns its process id."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        order = codec.encode(assignment)
        self._process.stdin.write(LENGTH.pack(len(order)) + order)
        self._process.stdin.flush()
        (pid,) = LENGTH.unpack(self._process.stdout.read(LENGTH.size))
        return int(pid)

    def close(self) -> None:
        """End it, and with it all that it started."""
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()


def serve(orders: IO[bytes], pids: IO[bytes]) -> None:
    """Fork a component for each order."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    nursery = os.getpid()
    while head := orders.read(LENGTH.size):
        order = orders.read(*LENGTH.unpack(head))
        pid = os.fork()
        if pid == 0:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            die_with_parent(nursery)
            code = 1
            try:
                code = run_component(codec.decode(order, Assignment))
            finally:
                sys.stderr.flush()
                os._exit(code)
        pids.write(LENGTH.pack(pid))
        pids.flush()


if __name__ == "__main__":
    for module in sys.argv[1:]:
        importlib.import_module(module)
    serve(sys.stdin.buffer, sys.stdout.buffer)
