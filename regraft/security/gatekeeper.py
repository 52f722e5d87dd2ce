"""Keeps the gate of a first host (``security.gate``) running: opens its socket, starts its process, restarts it."""

from __future__ import annotations

import json
import logging
import socket
import subprocess
import time
from pathlib import Path

from regraft.bus.interface import BusError
from regraft.bus.zenoh_config import Tls, address_of, host_and_port
from regraft.process.own_python import own_environment, own_python
from regraft.security import gate

BACKLOG = 1024
RETRY_INTERVAL = 1.0
"""Seconds between two starts of the process."""
END_TIMEOUT = 2.0


class Gatekeeper:
    """The gate at one ``tls/ADDRESS:PORT`` to the hub at a ``tcp/...`` endpoint on loopback.

    The socket is this process's: connections that come while the gate is started again wait in it.
    """

    def __init__(self, endpoint: str, hub: str, tls: Tls) -> None:
        """Listen; raises BusError if that cannot be."""
        self.tls = tls
        self._listening = _listening(endpoint)
        self._order = {
            "listening": self._listening.fileno(),
            "hub": address_of(hub),
            "files": (tls.authority, tls.certificate, tls.key),
        }
        self._process: subprocess.Popen[bytes] | None = None
        self._next_start = 0.0
        self._log = logging.getLogger("host")

    def keep(self) -> None:
        """Start the gate if it is not running; cheap enough for every turn of a loop."""
        if self._process is not None and self._process.poll() is not None:
            self._log.warning("the gate has ended (exit code %d): it is started again", self._process.returncode)
            self._forget()
        present = time.monotonic()
        if self._process is None and present >= self._next_start:
            self._next_start = present + RETRY_INTERVAL
            # Its standard input is how it learns that this process has ended, however it has.
            try:
                self._process = subprocess.Popen(
                    own_python(str(Path(gate.__file__)), json.dumps(self._order)),
                    stdin=subprocess.PIPE,
                    pass_fds=(self._listening.fileno(),),
                    env=own_environment(),
                )
            except OSError as error:
                self._log.warning("the gate cannot be started, and is tried again: %s", error)

    def _forget(self) -> None:
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()
        self._process = None

    def close(self) -> None:
        """End the gate with all its links."""
        process = self._process
        self._forget()
        self._listening.close()
        if process is not None:
            try:
                process.wait(END_TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _listening(endpoint: str) -> socket.socket:
    host, port = host_and_port(endpoint)
    try:
        family, kind, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        opened = socket.socket(family, kind)
    except OSError as error:
        raise BusError(f"cannot listen on {endpoint}: {_why(error)}") from None
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        # The kernel keeps a connection to itself until something comes by it.
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_DEFER_ACCEPT, int(gate.HANDSHAKE_TIMEOUT))
        opened.bind(address)
        opened.listen(BACKLOG)
    except OSError as error:
        opened.close()
        raise BusError(f"cannot listen on {endpoint}: {_why(error)}") from None
    return opened


def _why(error: OSError) -> str:
    return error.strerror or str(error)
