"""Replacing a running process by hand, with raw Zenoh: a source at a steady rate, and relays that come and go."""

from __future__ import annotations

import contextlib
import os
import signal
import struct
import threading
import time
from multiprocessing.connection import Connection

import zenoh

from regraft.bus.zenoh_config import Endpoints, config
from regraft.process.forked import die_with_parent

IN, OUT, SERVING = "raw/in", "raw/out", "raw/serving"
CLOSED_TIMEOUT = 0.2
NUMBER = struct.Struct("<Q")


def source(hub: Endpoints, rate: float) -> None:
    """Put 1, 2, 3 ... at ``rate`` (Hz), until terminated."""
    session = zenoh.open(config(hub, lockstep=False))
    publisher = session.declare_publisher(IN, congestion_control=zenoh.CongestionControl.BLOCK)
    number, due = 0, time.monotonic()
    while True:
        number += 1
        publisher.put(NUMBER.pack(number))
        due += 1.0 / rate
        time.sleep(max(0.0, due - time.monotonic()))


def relays(hub: Endpoints, commands: Connection) -> None:
    """Start a relay for each ``("start", number)``, end it for each ``("stop", number)``; answer when that is done.

    A relay is forked, as the host's are: this process opens no session. It says by a token that it serves.
    """
    pids: dict[int, int] = {}
    parent = os.getpid()
    while True:
        verb, number = commands.recv()
        if verb == "start":
            pid = os.fork()
            if pid == 0:
                _relay(hub, number, parent)
            pids[number] = pid
        else:
            os.kill(pids[number], signal.SIGTERM)
            os.waitpid(pids.pop(number), 0)
        commands.send(number)


def _relay(hub: Endpoints, number: int, parent: int) -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})  # also in threads to come: it stays pending
    die_with_parent(parent)
    try:
        session = zenoh.open(config(hub, lockstep=False))
        publisher = session.declare_publisher(OUT, congestion_control=zenoh.CongestionControl.BLOCK)

        def pass_on(sample: zenoh.Sample) -> None:
            with contextlib.suppress(zenoh.ZError):  # a session that is being closed still hears something
                publisher.put(sample.payload.to_bytes())

        subscriber = session.declare_subscriber(IN, pass_on)
        with session.liveliness().declare_token(f"{SERVING}/{number}"):
            signal.sigwait({signal.SIGTERM})

        def leave() -> None:
            subscriber.undeclare()  # type: ignore[no-untyped-call]
            session.close()  # type: ignore[no-untyped-call]

        # Leaving has been seen to wait for a callback that waits itself.
        closing = threading.Thread(target=leave, daemon=True)
        closing.start()
        closing.join(CLOSED_TIMEOUT)
    finally:
        os._exit(0)
