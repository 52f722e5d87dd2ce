"""How a Zenoh session is configured: everything explicit, nothing discovered, nothing beyond loopback by itself."""

from __future__ import annotations

import contextlib
import ipaddress
import json
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import zenoh

from regraft.bus.interface import BusError

MEGABYTE = 1024 * 1024

LEASE = 10_000
"""Milliseconds that others wait for a sign of life on this process's link before they take it for lost.

A process that a busy machine keeps from running must not lose its link. Dead processes are seen by their closed
sockets, hung ones by their heartbeat, lost hosts by their own leases: this one is for pulled cables alone.
"""
MAX_PORT = 65535
_PORT = re.compile("[0-9]{1,5}")
MAX_PENDING = 512
"""Connections to a hub that have not proved themselves yet; further ones are closed. Each takes a file."""
BLOCKED_AT_HUB = 0.2
"""Seconds that a hub waits for room on a reader's link, under the real clock, before it closes the link."""
BLOCKED_PUT = 0.4
"""The same for components and clients, whose link leads to a hub. It is less than a loop may be silent.

It is longer than at the hub, or a reader that stopped would cost a writer its link.
"""
BLOCKED_PUT_IN_STEP = 15.0
"""The same under simulated time: longer than the step bound, since one lost message would mean waiting for ever."""
SHARED_MEMORY_FROM = 128 * 1024
"""Bytes of a message from which on it goes through shared memory.

A pool is in memory as a whole once its first message is written: too much for a robot's architecture, 55 to 105 kB.
"""
SHARED_MEMORY_POOL = 64 * MEGABYTE
WAIT_FOR_NO_TOOL = {
    "id": "tools",
    "link_protocols": ["unixsock-stream"],
    "flows": ["egress"],
    "messages": ["put", "delete"],
    "overwrite": {"congestion_control": "drop"},
}
USER = "regraft"
"""The user name that goes with a system's secret; Zenoh wants one."""


@dataclass(frozen=True, slots=True)
class Tls:
    """Files of mutual TLS: the authority that both ends trust, and this end's certificate and private key (PEM)."""

    authority: str
    certificate: str
    key: str


@dataclass(frozen=True, slots=True)
class Endpoints:
    """Where a session listens and connects, such as ``tcp/127.0.0.1:7447``; ``router`` makes it a hub.

    ``tools`` is a Unix socket at which a hub listens, too. Nobody waits for a tool that comes there: data that it is
    too slow for are left out. Zenoh knows it by the kind of its link, so the hub must have no other of this kind.

    ``tls`` is what it needs to connect to ``tls/...`` endpoints; a hub listens at none, ``regraft.security.gate`` does.
    ``secret`` proves that a session belongs to the system: a hub admits nobody without it, over any kind of link; with
    an empty one it admits everybody.
    """

    listen: tuple[str, ...] = ()
    connect: tuple[str, ...] = ()
    router: bool = False
    tools: str = ""
    tls: Tls | None = None
    secret: str = field(default="", repr=False)

    @property
    def needs_hub(self) -> bool:
        """Whether the session is nothing without the hub that it connects to."""
        return bool(self.connect) and not self.router


@contextlib.contextmanager
def admitted(endpoints: Endpoints) -> Iterator[str]:
    """Hold, while a hub's session is being opened, the file from which it reads who is admitted; yields its path.

    The path is empty for a session that nobody connects to. The file is in memory and has no name: others cannot read
    it, and it leaves nothing.
    """
    if not (endpoints.listen and endpoints.secret):
        yield ""
        return
    descriptor = os.memfd_create("admitted")
    try:
        os.write(descriptor, f"{USER}:{endpoints.secret}\n".encode())
        yield f"/proc/self/fd/{descriptor}"
    finally:
        os.close(descriptor)


def config(endpoints: Endpoints, *, lockstep: bool, admitted: str = "") -> zenoh.Config:
    """Return the configuration of one session; ``lockstep`` is true under simulated time.

    ``admitted`` is the path of the file that names who may connect to a hub; without one everybody may.
    """
    blocked = BLOCKED_PUT_IN_STEP if lockstep else (BLOCKED_AT_HUB if endpoints.router else BLOCKED_PUT)
    listen = [*endpoints.listen, endpoints.tools] if endpoints.tools else list(endpoints.listen)
    settings: dict[str, object] = {
        "mode": "router" if endpoints.router else ("client" if endpoints.needs_hub else "peer"),
        "listen/endpoints": listen,
        "connect/endpoints": list(endpoints.connect),
        "connect/retry": {"period_init_ms": 50, "period_max_ms": 100, "period_increase_factor": 1},
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,
        "adminspace/enabled": False,
        "transport/unicast/accept_pending": MAX_PENDING,
        "transport/link/tx/lease": LEASE,
        "transport/link/tx/queue/size/data": 16,
        "transport/link/rx/buffer_size": 4 * MEGABYTE,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": int(blocked * 1e6),
        "transport/shared_memory/transport_optimization/message_size_threshold": SHARED_MEMORY_FROM,
        "transport/shared_memory/transport_optimization/pool_size": SHARED_MEMORY_POOL,
    }
    if endpoints.router:
        settings["connect/exit_on_failure"] = False
    if endpoints.tools:
        settings["qos/network"] = [WAIT_FOR_NO_TOOL]
    if endpoints.tls:
        settings |= _tls_settings(endpoints.tls)
    if endpoints.secret:
        settings |= {"transport/auth/usrpwd/user": USER, "transport/auth/usrpwd/password": endpoints.secret}
    if admitted:
        settings["transport/auth/usrpwd/dictionary_file"] = admitted
    made = zenoh.Config()
    for key, value in settings.items():
        made.insert_json5(key, json.dumps(value))
    return made


def _tls_settings(tls: Tls) -> dict[str, object]:
    link = "transport/link/tls"
    return {
        f"{link}/root_ca_certificate": tls.authority,
        f"{link}/enable_mtls": True,
        f"{link}/verify_name_on_connect": True,
        f"{link}/connect_certificate": tls.certificate,
        f"{link}/connect_private_key": tls.key,
    }


def address_of(endpoint: str) -> str:
    """Return the address of an endpoint, without its protocol."""
    return endpoint.partition("/")[2]


def host_and_port(endpoint: str) -> tuple[str, int]:
    """Return the host, without brackets, and the port of a ``tcp/`` or ``tls/`` endpoint; raises BusError."""
    host, _, port = address_of(endpoint).rpartition(":")
    # The resolver takes a number that is too large modulo 65536.
    if not host or not _PORT.fullmatch(port) or not 0 < int(port) <= MAX_PORT:
        raise BusError(
            f"{endpoint!r} is no endpoint; it must look like tls/192.0.2.7:7447 or tls/[2001:db8::7]:7447, "
            f"with a port from 1 to {MAX_PORT}"
        )
    host = host.strip("[]")
    try:
        host.encode("idna")  # the resolver does it, too
    except UnicodeError:
        raise BusError(
            f"{endpoint!r} is no endpoint: {host!r} is no name of a host; its parts must have 1 to 63 characters"
        ) from None
    return host, int(port)


def on_loopback(endpoint: str) -> bool:
    """Return whether an endpoint stays on this machine: whether it has a loopback address.

    Raises:
        BusError: the endpoint is not of the form ``protocol/address``.
    """
    protocol, separator, address = endpoint.partition("/")
    if not separator or not protocol or not address:
        raise BusError(f"{endpoint!r} is no endpoint; it must look like tcp/127.0.0.1:7447 or tls/192.0.2.7:7447")
    name = address.rpartition(":")[0].strip("[]")
    if name == "localhost":
        return True
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return False
