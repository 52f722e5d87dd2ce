"""TCP ports for tests, also where several processes run tests at the same time."""

from __future__ import annotations

import itertools
import os
import socket

LOWEST = 20_000
EACH = 1000
"""Ports below those that the system gives away by itself; every worker of a test run has so many for itself."""

_worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
_turn = itertools.count(os.getpid())


def free_port() -> int:
    """Return a loopback TCP port that is free, and that nobody else is given meanwhile."""
    for _ in range(EACH):
        port = LOWEST + _worker % 10 * EACH + next(_turn) % EACH
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise OSError("no TCP port is free")


def free_endpoint() -> str:
    """Return a loopback endpoint for a hub."""
    return f"tcp/127.0.0.1:{free_port()}"
