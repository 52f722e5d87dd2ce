"""The owner of a socket. The kernel answers for one socket at once, and where it may not be asked, lists them all.

The question is ``NETLINK_SOCK_DIAG`` (sock_diag(7)); the lists are ``/proc/net/tcp`` and ``tcp6``. The list has to be
made for each look: with 10,000 sockets that took 28 ms, and the question 0.02 ms.
"""

from __future__ import annotations

import ipaddress
import socket
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Final

TABLES: Final = Path("/proc/net")
NETLINK_SOCK_DIAG: Final = 4
SOCK_DIAG_BY_FAMILY: Final = 20
NLM_F_REQUEST: Final = 1
HEADER: Final = struct.Struct("=IHHII")
"""Of a netlink message: length, type, flags, sequence number, port."""
ANY_STATE: Final = 0xFFFFFFFF
NO_COOKIE: Final = 0xFFFFFFFF
UID_AND_INODE: Final = struct.Struct("=II")
STATE_AT, UID_AT = HEADER.size + 1, HEADER.size + 64
ANSWER_TIMEOUT: Final = 1.0

End = tuple[str, int]


@dataclass(frozen=True, slots=True)
class Owner:
    """The user that a TCP socket belongs to, and the socket's state as the kernel numbers them."""

    uid: int
    state: int


def owner(client: End, server: End) -> Owner | None:
    """Return whose the client's socket is, None if there is none that belongs to a process."""
    return asked(client, server) or listed(client, server)


def asked(client: End, server: End) -> Owner | None:
    """Return what the kernel answers, None if it knows no such socket or may not be asked."""
    try:
        question = _question(client, server)
        with socket.socket(socket.AF_NETLINK, socket.SOCK_DGRAM, NETLINK_SOCK_DIAG) as link:
            link.settimeout(ANSWER_TIMEOUT)
            link.send(question)
            answer = link.recv(8192)
    except (OSError, ValueError):
        return None
    if len(answer) < UID_AT + UID_AND_INODE.size or HEADER.unpack_from(answer)[1] != SOCK_DIAG_BY_FAMILY:
        return None
    uid, inode = UID_AND_INODE.unpack_from(answer, UID_AT)
    return _of_a_process(uid, answer[STATE_AT], inode)


def listed(client: End, server: End, tables: Path = TABLES) -> Owner | None:
    """Return the owner by the kernel's lists, None if the socket is on none of them."""
    for table, ends in _rows(client, server):
        try:
            text = (tables / table).read_bytes()
        except OSError:
            continue
        at = text.find(b" %s " % ends)
        if at >= 0:
            fields = text[at : text.find(b"\n", at)].split()
            return _of_a_process(int(fields[6]), int(fields[2], 16), int(fields[8]))
    return None


def _of_a_process(uid: int, state: int, inode: int) -> Owner | None:
    """Return an owner; a socket that no process holds any more has inode 0, and seems to be root's."""
    return Owner(uid, state) if inode else None


def _question(client: End, server: End) -> bytes:
    """Return the request for one socket; raises ValueError."""
    here, there = _address(client[0]), _address(server[0])
    if here.version != there.version:
        raise ValueError(f"no connection leads from {here} to {there}")
    family = socket.AF_INET if here.version == 4 else socket.AF_INET6
    ends = struct.pack("!HH", client[1], server[1]) + here.packed.ljust(16, b"\0") + there.packed.ljust(16, b"\0")
    body = struct.pack("=BBBBI", family, socket.IPPROTO_TCP, 0, 0, ANY_STATE) + ends
    body += struct.pack("=III", 0, NO_COOKIE, NO_COOKIE)
    return HEADER.pack(HEADER.size + len(body), SOCK_DIAG_BY_FAMILY, NLM_F_REQUEST, 1, 0) + body


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
