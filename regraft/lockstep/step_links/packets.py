"""Packets between two processes of one user, over a Unix socket."""

from __future__ import annotations

import os
import socket
import struct

LARGEST = 64 * 1024
"""Bytes of a packet; what is larger goes over the bus."""
_AT_ONCE = int(socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
"""Joining the two flags in each `send` would take as long as some of the sending."""
_CREDENTIALS = struct.Struct("3i")


def packet_socket() -> socket.socket:
    """Return a new socket that keeps packets whole, and in their order."""
    return socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_CLOEXEC)


def send(end: socket.socket, packet: bytes) -> bool:
    """Send a packet at once; returns whether it was sent."""
    if len(packet) > LARGEST:
        return False
    try:
        end.send(packet, _AT_ONCE)
    except OSError:
        return False
    return True


def receive(end: socket.socket) -> bytes | None:
    """Return the packet that has come: None if there is none yet, an empty one at the end of the link."""
    try:
        return end.recv(LARGEST, socket.MSG_DONTWAIT)
    except BlockingIOError:
        return None
    except OSError:
        return b""


def is_of_this_user(connected: socket.socket) -> bool:
    """Return whether the other end is a process of this user."""
    found = connected.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    return bool(_CREDENTIALS.unpack(found)[1] == os.geteuid())
