"""The plain way to have a process started again: fork, open a session, declare a token; nothing is watched."""

from __future__ import annotations

import os
import threading
from multiprocessing.connection import Connection

import zenoh

from regraft.bus.zenoh_config import Endpoints, config

ALIVE = "plain/alive"


def respawner(hub: Endpoints, pids: Connection, rounds: int) -> None:
    """Fork a child that appears at ``plain/alive/N``, tell its pid, and fork the next when it ends."""
    for number in range(rounds):
        pid = os.fork()
        if pid == 0:
            try:
                session = zenoh.open(config(hub, lockstep=False))
                token = session.liveliness().declare_token(f"{ALIVE}/{number}")
                threading.Event().wait()
                del token
            finally:
                os._exit(1)
        pids.send(pid)
        os.waitpid(pid, 0)
