"""The gate of a first host: TLS from other machines ends here, and only those with a certificate reach the hub.

A process of its own, run as a script: it needs the standard library alone. Zenoh's own listener stops for 0.1 s after
every handshake that fails (1.10.2). So 200 silent connections would lock everybody out for 20 s of every 30. Here an
unproved connection costs a socket for two seconds, and no other one waits for it.
"""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import json
import resource
import selectors
import signal
import socket
import ssl
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

HANDSHAKE_TIMEOUT = 2.0
"""Seconds that a connection has for its TLS handshake."""
MAX_PENDING = 256
"""Connections that may be in their handshake. With one more, the oldest of the address that has most is dropped."""
CHUNK = 64 * 1024
MAX_BUFFERED = 256 * 1024
"""Bytes that wait for one end of a link; until some have gone, no more is read from the other end."""
ACCEPT_AT_ONCE = 64
READ, WRITE = selectors.EVENT_READ, selectors.EVENT_WRITE
OUT_OF_FILES = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)

Step = Callable[[], None]
AGAIN = (ssl.SSLWantReadError, ssl.SSLWantWriteError, BlockingIOError, InterruptedError)


@dataclass(slots=True, eq=False)
class _Arrival:
    """A connection in its handshake; ``refused`` waits until the other end has read why."""

    link: socket.socket
    origin: str
    until: float
    refused: bool = False


@dataclass(slots=True, eq=False)
class _End:
    """One end of a link: its socket, what waits to be sent to it, and whether no more comes from it."""

    link: socket.socket
    waiting: bytearray
    over: bool = False
    turned: bool = False
    """TLS may have to write before it can read."""


class Gate:
    """Admits connections and forwards their data, on one thread."""

    def __init__(self, listening: socket.socket, hub: tuple[str, int], context: ssl.SSLContext) -> None:
        """Take over a socket that listens; ``hub`` is where links are passed on to."""
        self._listening = listening
        self._hub = hub
        self._context = context
        self._selector = selectors.DefaultSelector()
        self._pending: dict[_Arrival, None] = {}

    def run(self, life: int) -> None:
        """Serve until the file ``life`` ends: its other end is held by the host."""
        over = False

        def end() -> None:
            nonlocal over
            over = True

        self._listening.setblocking(False)
        self._selector.register(life, READ, end)
        self._selector.register(self._listening, READ, self._accept)
        while not over:
            for key, _ in self._selector.select(self._patience()):
                if _is_watched(self._selector, key.fileobj):  # an earlier step of this round may have closed it
                    key.data()
            self._drop_late()
        self._close()

    def _close(self) -> None:
        for key in list(self._selector.get_map().values()):
            if isinstance(key.fileobj, socket.socket):
                key.fileobj.close()
        self._selector.close()

    def _patience(self) -> float | None:
        oldest = next(iter(self._pending), None)
        return max(0.0, oldest.until - time.monotonic()) if oldest else None

    # --- connections in their handshake ---

    def _accept(self) -> None:
        for _ in range(ACCEPT_AT_ONCE):
            try:
                link, address = self._listening.accept()
            except BlockingIOError:
                return
            except OSError as error:
                if error.errno in OUT_OF_FILES:
                    self._make_room()
                return
            arrival = _Arrival(link, _origin(address[0]), time.monotonic() + HANDSHAKE_TIMEOUT)
            if len(self._pending) >= MAX_PENDING:
                self._make_room()
            link.setblocking(False)
            self._pending[arrival] = None
            self._selector.register(link, READ, lambda arrival=arrival: self._greet(arrival))

    def _make_room(self) -> None:
        """Drop the oldest connection of the address that has most: a flood from one displaces nobody else."""
        if not self._pending:
            time.sleep(0.01)  # all files are links: they are few enough, or the limit is far too low
            return
        most = Counter(arrival.origin for arrival in self._pending).most_common(1)[0][0]
        self._drop(next(arrival for arrival in self._pending if arrival.origin == most))

    def _drop_late(self) -> None:
        present = time.monotonic()
        while (oldest := next(iter(self._pending), None)) is not None and oldest.until <= present:
            self._drop(oldest)

    def _drop(self, arrival: _Arrival) -> None:
        del self._pending[arrival]
        _unwatch(self._selector, arrival.link)
        arrival.link.close()

    def _greet(self, arrival: _Arrival) -> None:
        """Begin the handshake now that the other end has sent something, or continue with it."""
        link = arrival.link
        try:
            if arrival.refused:
                if not link.recv(CHUNK):
                    self._drop(arrival)
                return
            if not isinstance(link, ssl.SSLSocket):
                self._selector.unregister(link)
                arrival.link = link = self._context.wrap_socket(link, server_side=True, do_handshake_on_connect=False)
                self._selector.register(link, READ, lambda: self._greet(arrival))
            link.do_handshake()
        except AGAIN as error:
            wanted = READ | WRITE if isinstance(error, ssl.SSLWantWriteError) else READ
            self._selector.modify(arrival.link, wanted, lambda: self._greet(arrival))
        except (OSError, ValueError):
            self._refuse(arrival)
        else:
            del self._pending[arrival]
            self._selector.unregister(link)
            self._admit(link)

    def _refuse(self, arrival: _Arrival) -> None:
        """Close the connection so that the reason, a TLS alert, arrives: closing with bytes unread would reset it."""
        _unwatch(self._selector, arrival.link)
        arrival.link, arrival.refused = _plain(arrival.link), True
        try:
            arrival.link.shutdown(socket.SHUT_WR)
        except OSError:
            self._drop(arrival)
        else:
            self._selector.register(arrival.link, READ, lambda: self._greet(arrival))

    # --- links ---

    def _admit(self, near: socket.socket) -> None:
        far = socket.socket(socket.AF_INET)
        far.setblocking(False)
        for one in (near, far):
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        far.connect_ex(self._hub)
        link = _Link(self._selector, _End(near, bytearray()), _End(far, bytearray()))
        link.watch()


class _Link:
    """Passes on what comes from either end, until one of them is closed."""

    def __init__(self, selector: selectors.BaseSelector, near: _End, far: _End) -> None:
        self._selector = selector
        self._ends = ((near, far), (far, near))

    def step(self) -> None:
        """Pass on what can be."""
        try:
            for source, sink in self._ends:
                _read(source, sink)
                _write(sink)
        except (OSError, ValueError):
            self.close()
        else:
            self.watch()

    def watch(self) -> None:
        """Wait for what can be done next; close the link once an end is over and the other has all that it sent."""
        if any(source.over and not sink.waiting for source, sink in self._ends):
            self.close()
            return
        for end, other in self._ends:
            reads = READ if not end.over and len(other.waiting) < MAX_BUFFERED else 0
            self._want(end.link, reads | (WRITE if end.waiting or end.turned else 0))

    def _want(self, link: socket.socket, events: int) -> None:
        if not events:
            _unwatch(self._selector, link)
        elif not _is_watched(self._selector, link):
            self._selector.register(link, events, self.step)
        elif self._selector.get_key(link).events != events:
            self._selector.modify(link, events, self.step)

    def close(self) -> None:
        """Close both ends."""
        for end, _ in self._ends:
            self._want(end.link, 0)
            with contextlib.suppress(OSError, ValueError):
                if isinstance(end.link, ssl.SSLSocket):
                    end.link.unwrap()  # announces the end; its answer is not waited for
            end.link.close()


def _read(source: _End, sink: _End) -> None:
    source.turned = False
    while not source.over and len(sink.waiting) < MAX_BUFFERED:
        try:
            said = source.link.recv(CHUNK)
        except ssl.SSLEOFError:
            said = b""
        except AGAIN as error:
            source.turned = isinstance(error, ssl.SSLWantWriteError)
            return
        sink.waiting += said
        source.over = not said


def _write(sink: _End) -> None:
    try:
        while sink.waiting:
            del sink.waiting[: sink.link.send(sink.waiting[:CHUNK])]
    except AGAIN:
        return
    except OSError as error:
        if error.errno not in (errno.ENOTCONN, errno.EAGAIN):  # the way to the hub is being made
            raise


def _is_watched(selector: selectors.BaseSelector, link: Any) -> bool:
    try:
        return selector.get_key(link).fileobj is link
    except (KeyError, ValueError):
        return False


def _unwatch(selector: selectors.BaseSelector, link: socket.socket) -> None:
    if _is_watched(selector, link):
        selector.unregister(link)


def _plain(link: socket.socket) -> socket.socket:
    """Return a connection without its TLS."""
    if not isinstance(link, ssl.SSLSocket):
        return link
    plain = socket.socket(fileno=link.detach())
    plain.setblocking(False)
    return plain


def _origin(address: str) -> str:
    """Return by what connections are counted together: an IPv4 address, or an IPv6 network of 64 bits."""
    parsed = ipaddress.ip_address(address.partition("%")[0])
    mapped = parsed.ipv4_mapped if isinstance(parsed, ipaddress.IPv6Address) else None
    return str(mapped or parsed) if parsed.version == 4 or mapped else str(int(parsed) >> 64)


def context_of(authority: str, certificate: str, key: str) -> ssl.SSLContext:
    """Return how the gate proves itself, and whom it admits; raises OSError, ssl.SSLError for files of no use."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.verify_mode = ssl.CERT_REQUIRED
    context.num_tickets = 0  # every link shows its certificate
    context.load_verify_locations(authority)
    context.load_cert_chain(certificate, key)
    return context


def main(order: str) -> None:
    """Be the gate until the standard input ends; ``order`` is JSON."""
    for ignored in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_IGN)
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    told = json.loads(order)
    listening = socket.socket(fileno=told["listening"])
    host, _, port = told["hub"].rpartition(":")
    Gate(listening, (host, int(port)), context_of(*told["files"])).run(sys.stdin.fileno())


if __name__ == "__main__":
    main(sys.argv[1])
