"""Connections from nobody: many at a time, opened again soon after they are closed."""

from __future__ import annotations

import contextlib
import selectors
import socket
import ssl
import threading

PAUSE = 0.1
"""Seconds between two looks at what was closed: connections in a loop would take the processors from all others."""


def hello() -> bytes:
    """Return the first flight of a TLS client."""
    context = ssl.create_default_context()
    outgoing = ssl.MemoryBIO()
    with contextlib.suppress(ssl.SSLWantReadError):
        context.wrap_bio(ssl.MemoryBIO(), outgoing, server_hostname="robot").do_handshake()
    return outgoing.read()


class Strangers:
    """So many connections to a port of this machine, each of which says ``word`` and then keeps silent."""

    def __init__(self, port: int, count: int, word: bytes = b"", source: str = "127.0.0.1") -> None:
        """Open them; returns once all have been opened."""
        self.closed = 0
        """How many of them the other end has closed."""
        self._port, self._word, self._source = port, word, source
        self._over = threading.Event()
        self._selector = selectors.DefaultSelector()
        for _ in range(count):
            self._open()
        self._thread = threading.Thread(target=self._stay, daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Close all."""
        self._over.set()
        self._thread.join()
        for key in list(self._selector.get_map().values()):
            self._close(key.fileobj)

    def _open(self) -> None:
        link = socket.create_connection(("127.0.0.1", self._port), source_address=(self._source, 0))
        link.sendall(self._word)
        link.setblocking(False)
        self._selector.register(link, selectors.EVENT_READ)

    def _close(self, link: object) -> None:
        assert isinstance(link, socket.socket)
        self._selector.unregister(link)
        link.close()

    def _stay(self) -> None:
        while not self._over.wait(PAUSE):
            for key, _ in self._selector.select(0.05):
                link = key.fileobj
                assert isinstance(link, socket.socket)
                try:
                    said = link.recv(65536)
                except BlockingIOError:
                    continue
                except OSError:
                    said = b""
                if not said:
                    self.closed += 1
                    self._close(link)
                    with contextlib.suppress(OSError):
                        self._open()
