"""The other side of the round trips: zenoh-python as one would use it without a kit, over the same links.

A callback copies the payload out and puts the next message; nothing is decoded, numbered or checked. Like the
kit, it keeps freed memory: otherwise large messages measure glibc's page faults, which differ from run to run.
"""

from __future__ import annotations

import struct
import threading
import time
from array import array
from itertools import pairwise

import zenoh

from regraft.bus.zenoh_config import Endpoints, config
from regraft.process.malloc import keep_freed_memory

PING, PONG, VOLLEY, READY = "raw/ping", "raw/pong", "raw/volley", "raw/ready"
QUESTION = "raw/question"
ASKED = struct.Struct("<II")
VOLLEY_TIMEOUT = 60.0


def echo(hub: Endpoints) -> None:
    """Send everything back, until terminated."""
    session = _open(hub)
    pong = session.declare_publisher(PONG, congestion_control=zenoh.CongestionControl.BLOCK)

    def there(sample: zenoh.Sample) -> None:
        pong.put(sample.payload.to_bytes())

    declared = (session.declare_subscriber(PING, there), session.liveliness().declare_token(f"{READY}/echo"))
    _stay(declared)


def pinger(hub: Endpoints) -> None:
    """Play volleys as asked for at ``VOLLEY`` (count, size), replying with the seconds, until terminated."""
    session = _open(hub)
    ping = session.declare_publisher(PING, congestion_control=zenoh.CongestionControl.BLOCK)
    stamps: list[int] = []
    wanted = 0
    data = b""
    done = threading.Event()

    def back(sample: zenoh.Sample) -> None:
        sample.payload.to_bytes()
        stamps.append(time.perf_counter_ns())
        if len(stamps) <= wanted:
            ping.put(data)
        else:
            done.set()

    def volley(query: zenoh.Query) -> None:
        nonlocal wanted, data
        assert query.payload is not None
        wanted, size = ASKED.unpack(query.payload.to_bytes())
        data = bytes(size)
        stamps.clear()
        done.clear()
        stamps.append(time.perf_counter_ns())
        ping.put(data)
        done.wait(VOLLEY_TIMEOUT)
        query.reply(VOLLEY, array("d", ((b - a) / 1e9 for a, b in pairwise(stamps))).tobytes())
        query.drop()  # type: ignore[no-untyped-call]

    declared = (
        session.declare_subscriber(PONG, back),
        session.declare_queryable(VOLLEY, volley),
        session.liveliness().declare_token(f"{READY}/pinger"),
    )
    _stay(declared)


def answerer(hub: Endpoints) -> None:
    """Answer every question at ``QUESTION`` with what came with it, until terminated."""
    session = _open(hub)

    def answer(query: zenoh.Query) -> None:
        assert query.payload is not None
        query.reply(QUESTION, query.payload.to_bytes())
        query.drop()  # type: ignore[no-untyped-call]

    declared = (
        session.declare_queryable(QUESTION, answer),
        session.liveliness().declare_token(f"{READY}/answerer"),
    )
    _stay(declared)


def _open(hub: Endpoints) -> zenoh.Session:
    keep_freed_memory()
    return zenoh.open(config(hub, lockstep=False))


def _stay(declared: tuple[object, ...]) -> None:
    """Wait for SIGTERM, which ends the process; what is declared must be held, or it is undeclared."""
    threading.Event().wait()
    del declared
