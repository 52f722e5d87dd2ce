"""Bare Zenoh processes: the baseline of starting and of memory."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

from regraft.bus.zenoh_bus import ZenohBus, open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.system.launch import free_endpoint

BARE = """
import sys, threading, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", f'["{sys.argv[1]}"]')
config.insert_json5("scouting/multicast/enabled", "false")
config.insert_json5("scouting/gossip/enabled", "false")
session = zenoh.open(config)
token = session.liveliness().declare_token(f"bare/{sys.argv[2]}")
threading.Event().wait()
"""


@dataclass(frozen=True, slots=True)
class Bare:
    """Processes, a session on their hub, and when the first was started (monotonic seconds)."""

    bus: ZenohBus
    processes: list[subprocess.Popen[bytes]]
    begun: float


@contextlib.contextmanager
def bare_processes(count: int) -> Iterator[Bare]:
    """Hold so many bare processes, just started; each shows a token ``bare/NUMBER``."""
    endpoint = free_endpoint()
    hub = open_bus(Endpoints((endpoint,), router=True))
    bus = open_bus(Endpoints(connect=(endpoint,)))
    processes: list[subprocess.Popen[bytes]] = []
    try:
        begun = time.monotonic()
        processes += [
            subprocess.Popen([sys.executable, "-P", "-c", BARE, endpoint, str(number)]) for number in range(count)
        ]
        yield Bare(bus, processes, begun)
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()
        bus.close()
        hub.close()
