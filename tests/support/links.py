"""Network links that tests can cut."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress

from tests.support.machine.ports import free_port


class Link:
    """A TCP link that passes everything on, until it is cut: what is then sent is neither delivered nor refused."""

    def __init__(self, target: str) -> None:
        self._target = int(target.rpartition(":")[2])
        self._listening = socket.create_server(("127.0.0.1", free_port()))
        self.endpoint = f"tcp/127.0.0.1:{self._listening.getsockname()[1]}"
        self._whole = threading.Event()
        self._whole.set()
        self._sockets: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        """Deliver nothing any more; neither end is told."""
        self._whole.clear()

    def heal(self) -> None:
        """Deliver again, also what was sent meanwhile."""
        self._whole.set()

    def close(self) -> None:
        """End it."""
        self._whole.set()
        for one in (self._listening, *self._sockets):
            one.close()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listening.accept()
            except OSError:
                return
            try:
                far = socket.create_connection(("127.0.0.1", self._target))
            except OSError:
                near.close()
                continue
            self._sockets += [near, far]
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self._pass_on, args=(source, sink), daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        try:
            while data := source.recv(65536):
                self._whole.wait()
                sink.sendall(data)
        except OSError:
            pass
        for one in (source, sink):
            one.close()


class Cable:
    """A TCP link that closes when it is cut, as one end would close it, and that is made anew."""

    def __init__(self, hub: int) -> None:
        self.plugged = True
        self._hub = hub
        self._ends: list[socket.socket] = []
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._socket.accept()
                if not self.plugged:
                    near.close()
                    continue
                try:
                    far = socket.create_connection(("127.0.0.1", self._hub))
                except OSError:  # the hub has ended
                    near.close()
                    continue
                self._ends += [near, far]
                for pair in ((near, far), (far, near)):
                    threading.Thread(target=_pass_on, args=pair, daemon=True).start()

    def cut(self) -> None:
        ends, self._ends = self._ends, []
        for end in ends:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def close(self) -> None:
        self.plugged = False
        self.cut()
        self._socket.close()


def _pass_on(source: socket.socket, target: socket.socket) -> None:
    with suppress(OSError):
        while data := source.recv(1 << 16):
            target.sendall(data)
        target.shutdown(socket.SHUT_RDWR)
