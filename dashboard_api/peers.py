"""Who is at the other end of a connection, as the kernel tells it: the user that owns the client's socket.

The kernel lists all sockets of this machine in ``/proc/net/tcp`` and ``tcp6``, each with its two ends, its state, the
uid of its owner and an inode. The client's socket is the one whose ends are ours the other way round.
"""

from __future__ import annotations

import ipaddress
import socket
import struct
from pathlib import Path
from typing import Any, Final

from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

CONNECTION: Final = "regraft.connection"
"""Where a request's scope has the server's end of its connection."""
TABLES: Final = Path("/proc/net")
LOOKS: Final = 3
"""How often a table is read: a row can be missed while others come and go."""
ESTABLISHED, FIN_WAIT1, FIN_WAIT2, CLOSE_WAIT = 1, 4, 5, 8
LINKED: Final = {ESTABLISHED: {ESTABLISHED, FIN_WAIT1, FIN_WAIT2}, CLOSE_WAIT: {FIN_WAIT1, FIN_WAIT2}}
"""The states that the client's end can have, by the state of ours: open, or the client has nothing more to send."""

End = tuple[str, int]


class KnownConnection(H11Protocol):
    """HTTP on one connection, which its requests can look at."""

    def connection_made(self, transport: Any) -> None:
        """Give each request the connection."""
        super().connection_made(transport)
        app: ASGIApp = self.app
        connection = transport.get_extra_info("socket")

        async def known(scope: Scope, receive: Receive, send: Send) -> None:
            scope[CONNECTION] = connection
            await app(scope, receive, send)

        self.app = known


def user_of(scope: Scope, tables: Path = TABLES) -> int | None:
    """Return the uid of the user at the other end of a request's connection, None if the kernel cannot say."""
    connection, client, server = scope.get(CONNECTION), scope.get("client"), scope.get("server")
    if connection is None or not client or not server:
        return None
    for _ in range(LOOKS):
        found = owner((client[0], client[1]), (server[0], server[1]), tables)
        if found is not None:
            # Looked at last: a client that has hung up since could have left its address to somebody else.
            uid, state = found
            if state in LINKED.get(_state_of(connection), ()):
                return uid
    return None


def owner(client: End, server: End, tables: Path = TABLES) -> tuple[int, int] | None:
    """Return uid and state of the client's socket, None if there is none that belongs to a process."""
    for table, ends in _rows(client, server):
        try:
            text = (tables / table).read_bytes()
        except OSError:
            continue
        at = text.find(b" %s " % ends)
        if at >= 0:
            return _read(text[at : text.find(b"\n", at)].split())
    return None


def _read(fields: list[bytes]) -> tuple[int, int] | None:
    """Return uid and state of a row, from its ends on.

    A socket that no process holds any more has inode 0, and many kernels give it to root: it proves nothing.
    """
    state, uid, inode = int(fields[2], 16), int(fields[6]), int(fields[8])
    return (uid, state) if inode else None


def _rows(client: End, server: End) -> list[tuple[str, bytes]]:
    """Return in which tables a client's row may be, and how its two ends are written there."""
    try:
        here, there = _address(client[0]), _address(server[0])
    except ValueError:
        return []
    if here.version != there.version:
        return []
    written = b"%s:%04X %s:%04X"
    if isinstance(here, ipaddress.IPv6Address) or isinstance(there, ipaddress.IPv6Address):
        return [("tcp6", written % (_words(here.packed), client[1], _words(there.packed), server[1]))]
    # A program may speak IPv4 through a socket for IPv6.
    mapped = bytes(10) + b"\xff\xff"
    return [
        ("tcp", written % (_words(here.packed), client[1], _words(there.packed), server[1])),
        ("tcp6", written % (_words(mapped + here.packed), client[1], _words(mapped + there.packed), server[1])),
    ]


def _address(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
    address = ipaddress.ip_address(text.partition("%")[0])
    return getattr(address, "ipv4_mapped", None) or address


def _words(packed: bytes) -> bytes:
    """Return an address as the kernel writes it: words of 32 bits, each in this machine's own byte order."""
    return b"".join(b"%08X" % word for word in struct.unpack(f"={len(packed) // 4}I", packed))


def _state_of(connection: socket.socket) -> int:
    """Return the state of our end of a connection, 0 if it is gone."""
    try:
        return connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1)[0]
    except OSError:
        return 0
