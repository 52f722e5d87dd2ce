"""Plain data over a stream socket, one length-prefixed MessagePack value after the other."""

from __future__ import annotations

import socket
import struct
from typing import Any

import msgpack

LENGTH = struct.Struct("<I")


def send(line: socket.socket, value: Any) -> None:
    """Send one value; raises OSError when the other end has gone."""
    data = msgpack.packb(value)
    line.sendall(LENGTH.pack(len(data)) + data)


def receive(line: socket.socket) -> Any:
    """Return the next value, None when the other end has gone."""
    head = _exactly(line, LENGTH.size)
    if head is None:
        return None
    data = _exactly(line, LENGTH.unpack(head)[0])
    return None if data is None else msgpack.unpackb(data)


def _exactly(line: socket.socket, count: int) -> bytes | None:
    parts = bytearray()
    while len(parts) < count:
        try:
            part = line.recv(count - len(parts))
        except InterruptedError:
            continue
        except OSError:
            return None
        if not part:
            return None
        parts += part
    return bytes(parts)
