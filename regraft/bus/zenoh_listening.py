"""Has the kernel keep connections to a hub to itself until something comes by them.

Zenoh admits a limited number of connections that have not proved themselves yet, and closes all further ones.
Connections that stay silent would fill those places. This process owns Zenoh's sockets, so it finds them by their port.
"""

from __future__ import annotations

import contextlib
import os
import socket
import stat
from collections.abc import Iterable

SILENT_FOR = 60
"""Seconds that the kernel keeps a silent connection before it hands it over after all."""


def await_data(endpoints: Iterable[str]) -> None:
    """Set this for the TCP endpoints at which this process listens."""
    ports = {endpoint.rpartition(":")[2] for endpoint in endpoints if endpoint.startswith("tcp/")}
    if not ports:
        return
    for descriptor in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):  # it is closed by now
            if stat.S_ISSOCK(os.fstat(int(descriptor)).st_mode):
                _await_data(os.dup(int(descriptor)), ports)


def _await_data(descriptor: int, ports: set[str]) -> None:
    with socket.socket(fileno=descriptor) as found:
        of_tcp = found.family in (socket.AF_INET, socket.AF_INET6) and found.type == socket.SOCK_STREAM
        listens = of_tcp and found.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN)
        if listens and str(found.getsockname()[1]) in ports:
            found.setsockopt(socket.IPPROTO_TCP, socket.TCP_DEFER_ACCEPT, SILENT_FOR)
