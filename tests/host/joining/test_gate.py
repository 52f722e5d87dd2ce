"""Connections of strangers keep no host and no component out, whatever they say."""

from __future__ import annotations

import os
import socket
import ssl
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft.bus.interface import BusError
from regraft.bus.zenoh_bus import open_bus
from regraft.bus.zenoh_config import MAX_PENDING, Endpoints, Tls
from regraft.bus_schema.model.hosts.host_state import HostState
from regraft.security import gate
from regraft.security.access import Guard
from regraft.security.certificates import make
from regraft.security.gatekeeper import Gatekeeper
from tests.host.joining.strangers import Strangers, hello
from tests.host.several import TICKER, WAIT, Site
from tests.support.hosts import wait_state
from tests.support.machine.ports import free_endpoint, free_port
from tests.support.machine.processes import children_of, exists, kill
from tests.support.waiting import PATIENCE, wait_for, wait_until

pytestmark = pytest.mark.slow

HELLO = hello()
WORDS = {
    "silent": b"",
    "one byte": b"\x16",
    "half a handshake": HELLO[:100],
    "a handshake": HELLO,
    "no TLS": b"GET /\r\n",
}
SO_MANY = 200


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of certificates."""
    folder = tmp_path_factory.mktemp("gate") / "lab"
    make(folder, ["local", "edge"])
    return folder


def _tls(lab: Path, name: str) -> Tls:
    found = Guard(lab).tls(name)
    assert found is not None
    return found


# --- hubs ---


@pytest.fixture
def behind(lab: Path) -> Iterator[tuple[int, Endpoints]]:
    """Return the port of a gate before a hub, and how a session comes through it."""
    endpoint, port, secret = free_endpoint(), free_port(), Guard(lab).secret()
    hub = open_bus(Endpoints((endpoint,), router=True, secret=secret))
    keeper = Gatekeeper(f"tls/127.0.0.1:{port}", endpoint, _tls(lab, "local"))
    keeper.keep()
    yield port, Endpoints(connect=(f"tls/127.0.0.1:{port}",), tls=_tls(lab, "edge"), secret=secret)
    keeper.close()
    hub.close()


@pytest.mark.parametrize("word", WORDS.values(), ids=WORDS)
def test_sessions_come_through_the_gate_among_strangers(behind: tuple[int, Endpoints], word: bytes) -> None:
    port, endpoints = behind
    strangers = Strangers(port, SO_MANY, word)
    try:
        for _ in range(5):
            open_bus(endpoints).close()
        if word:
            wait_until(lambda: strangers.closed > SO_MANY, "all to have been dropped")
            open_bus(endpoints).close()
    finally:
        strangers.end()


@pytest.mark.parametrize(("count", "word"), [(MAX_PENDING + 50, b""), (SO_MANY, b"\x16")])
def test_strangers_lock_no_component_out_of_a_hub_on_loopback(count: int, word: bytes) -> None:
    endpoint = free_endpoint()
    hub = open_bus(Endpoints((endpoint,), router=True, secret="x" * 43))
    strangers = Strangers(int(endpoint.rpartition(":")[2]), count, word)
    try:
        for _ in range(5):
            open_bus(Endpoints(connect=(endpoint,), secret="x" * 43)).close()
    finally:
        strangers.end()
        hub.close()


# --- hosts ---


def test_hosts_join_and_join_again_among_strangers(site: Site, lab: Path) -> None:
    port = free_port()
    system = site.up(TICKER, WAIT, "--listen", f"tls/127.0.0.1:{port}", "--tls", str(lab))
    crowds = [Strangers(port, SO_MANY // len(WORDS), word) for word in WORDS.values()]
    try:
        for _ in range(2):
            guest = site.join("edge", f"tls/127.0.0.1:{port}", "--tls", str(lab))
            guest.end()
            wait_state(system, "edge", HostState.LEFT)
    finally:
        for crowd in crowds:
            crowd.end()


def test_hosts_come_back_when_the_gate_was_killed(site: Site, lab: Path) -> None:
    port = free_port()
    system = site.up(TICKER, WAIT, "--listen", f"tls/127.0.0.1:{port}", "--tls", str(lab))
    site.join("edge", f"tls/127.0.0.1:{port}", "--tls", str(lab))
    incarnation = site.wait_active("ticker")
    first = _gate_of(system.process.pid)
    kill(first)
    wait_until(lambda: system.said("host.silent", "edge"), "its link to be lost")
    wait_state(system, "edge", HostState.JOINED)
    assert _gate_of(system.process.pid) != first
    assert site.wait_active("ticker") == incarnation


def _gate_of(pid: int) -> int:
    def found() -> int | None:
        return next((child for child in children_of(pid) if _is_gate(child)), None)

    return wait_for(found, "the gate")


def _is_gate(pid: int) -> bool:
    try:
        return gate.__file__.encode() in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:  # it has ended meanwhile
        return False


def test_the_gate_ends_with_its_host_however_that_ends(site: Site, lab: Path) -> None:
    port = free_port()
    system = site.up(TICKER, WAIT, "--listen", f"tls/127.0.0.1:{port}", "--tls", str(lab))
    keeper = _gate_of(system.process.pid)
    system.process.kill()
    wait_until(lambda: not exists(keeper), "the gate to end")


def test_an_address_in_use_is_told_as_that(lab: Path) -> None:
    with socket.create_server(("127.0.0.1", free_port())) as taken:
        endpoint = f"tls/127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(BusError, match=f"cannot listen on {endpoint}: Address already in use"):
            Gatekeeper(endpoint, free_endpoint(), _tls(lab, "local"))


@pytest.mark.parametrize("address", ["127.0.0.1:74470", "robot..lab:7447"])
def test_an_address_that_is_none_is_told_as_that(address: str, lab: Path) -> None:
    with pytest.raises(BusError, match=f"'tls/{address}' is no endpoint"):
        Gatekeeper(f"tls/{address}", free_endpoint(), _tls(lab, "local"))


# --- one gate ---


@pytest.fixture
def served(lab: Path) -> Iterator[tuple[int, socket.socket]]:
    """Return the port of a gate on a thread of this process, and the socket at which its links arrive."""
    arriving = socket.create_server(("127.0.0.1", 0))
    listening = socket.create_server(("127.0.0.1", 0), backlog=1024)
    reader, writer = os.pipe()
    tls = _tls(lab, "local")
    one = gate.Gate(listening, arriving.getsockname(), gate.context_of(tls.authority, tls.certificate, tls.key))
    thread = threading.Thread(target=one.run, args=(reader,))
    thread.start()
    yield listening.getsockname()[1], arriving
    os.close(writer)
    thread.join()
    os.close(reader)
    for end in (arriving, listening):
        end.close()


def _certified(lab: Path) -> ssl.SSLContext:
    tls = _tls(lab, "edge")
    context = ssl.create_default_context(cafile=tls.authority)
    context.load_cert_chain(tls.certificate, tls.key)
    return context


def test_a_flood_from_one_address_displaces_no_handshake_of_another(
    served: tuple[int, socket.socket], lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gate, "HANDSHAKE_TIMEOUT", PATIENCE)
    port, arriving = served
    link = socket.create_connection(("127.0.0.1", port))
    flood = Strangers(port, gate.MAX_PENDING + 50, b"\x16", "127.0.0.2")
    try:
        wait_until(lambda: flood.closed > 50, "some of the flood to be dropped")
        link.settimeout(PATIENCE)
        with _certified(lab).wrap_socket(link, server_hostname="127.0.0.1") as safe:
            safe.sendall(b"here")
            hub, _ = arriving.accept()
            with hub:
                assert hub.recv(4) == b"here"
    finally:
        flood.end()


def test_bytes_arrive_whole_and_in_order_through_the_gate(served: tuple[int, socket.socket], lab: Path) -> None:
    port, arriving = served
    said = os.urandom(20_000_000)
    with _certified(lab).wrap_socket(
        socket.create_connection(("127.0.0.1", port)), server_hostname="127.0.0.1"
    ) as safe:
        hub, _ = arriving.accept()
        with hub:
            for sender, receiver in ((hub, safe), (safe, hub)):
                sending = threading.Thread(target=sender.sendall, args=(said,))
                sending.start()
                arrived = bytearray()
                while len(arrived) < len(said):
                    arrived += receiver.recv(65536)
                sending.join()
                assert arrived == said
            hub.sendall(b"the last")
            hub.close()
            assert safe.recv(100) == b"the last"
            assert safe.recv(100) == b"", "that it is over arrives after it"
