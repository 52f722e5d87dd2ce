from __future__ import annotations

import socket
import threading
import time
from urllib.parse import urlsplit

import httpx
import pytest

from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.dashboard_api.gateway import Gateway
from regraft.dashboard_api.server import CannotServe, bind
from regraft.runtime.core.assignment import Assignment
from tests.gateway.conftest import GATEWAY, Running, start_gateway
from tests.support.stepped.site import Site
from tests.support.waiting import PATIENCE, wait_until

BEAT = Assignment("", "", "").heartbeat
"""Seconds."""


def test_a_port_in_use_is_a_clear_error(site: Site) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        site.start(Gateway, "gateway", parameters={**GATEWAY, "port": port})
    status = site.runtimes["gateway"].reporter.status
    assert status.state is State.UNCONFIGURED
    assert f"127.0.0.1 port {port}" in status.error
    assert "in use" in status.error


@pytest.mark.parametrize("address", ["0.0.0.0", "::", "192.0.2.7"])
def test_only_loopback_is_served(address: str) -> None:
    with pytest.raises(CannotServe, match=r"access tokens to the network.*127\.0\.0\.1"):
        bind(address, 0)


@pytest.mark.parametrize("address", ["not an address", "robot..lab", f"{'a' * 64}.lab"])
def test_an_address_that_is_none_is_a_clear_error(address: str) -> None:
    with pytest.raises(CannotServe, match=f"'{address}'"):
        bind(address, 0)


def test_the_url_is_told_in_status_and_event(site: Site) -> None:
    told: list[str] = []
    site.client.events(lambda event: told.append(event.details["url"]) if event.kind == "gateway.ready" else None)
    url = start_gateway(site)
    assert urlsplit(url).path == "/api/v1"
    assert httpx.get(f"{url}/hosts", timeout=PATIENCE).status_code == 200
    wait_until(lambda: told == [url])


def test_an_inactive_gateway_serves_nothing_and_comes_back(site: Site) -> None:
    url = start_gateway(site)
    gateway = site.runtimes["gateway"]
    gateway.post(lambda: gateway.lifecycle.perform(Transition.DEACTIVATE))
    wait_until(lambda: gateway.state is State.INACTIVE)
    with pytest.raises(httpx.ConnectError):
        httpx.get(f"{url}/hosts")
    gateway.post(lambda: gateway.lifecycle.perform(Transition.ACTIVATE))
    wait_until(lambda: gateway.state is State.ACTIVE)
    assert httpx.get(f"{gateway.reporter.status.values['url']}/hosts", timeout=PATIENCE).status_code == 200


def test_the_gateway_ends_while_requests_wait_and_readers_read(running: Running) -> None:
    running.manager.silent = True
    answers: list[int] = []

    def ask() -> None:
        with running.connect() as http:
            answers.append(http.get("/architecture").status_code)

    waiting = threading.Thread(target=ask)
    with running.connect() as http, http.stream("GET", "/events") as stream:
        lines = stream.iter_lines()
        next(lines)
        waiting.start()
        assert running.manager.kept_waiting.wait(PATIENCE)
        gateway = running.site.runtimes["gateway"]
        gateway.post(lambda: gateway.lifecycle.perform(Transition.DEACTIVATE))
        assert "data: " not in "".join(lines)
    waiting.join(PATIENCE)
    wait_until(lambda: gateway.state is State.INACTIVE)
    assert answers == [503]


def test_clients_that_vanish_leave_nothing_behind(site: Site) -> None:
    before = set(threading.enumerate())
    url = urlsplit(start_gateway(site))
    assert url.hostname
    for path in ("/api/v1/events", "/api/v1/architecture", "/api/v1/system"):
        for _ in range(5):
            connection = socket.create_connection((url.hostname, url.port or 80))
            connection.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            connection.close()
    gateway = site.runtimes["gateway"]
    gateway.post(lambda: gateway.lifecycle.perform(Transition.DEACTIVATE))
    wait_until(lambda: gateway.state is State.INACTIVE)

    def left() -> set[str]:
        return {thread.name for thread in set(threading.enumerate()) - before if thread.is_alive()}

    wait_until(lambda: left() <= {"gateway", "alarm"}, "the server's threads to end")


def test_a_gateway_whose_loop_does_not_turn_is_as_silent_as_a_hung_component(running: Running) -> None:
    gateway, goes_on = running.site.runtimes["gateway"], threading.Event()
    server = gateway.component._server  # type: ignore[attr-defined]
    server._loop.call_soon_threadsafe(goes_on.wait, PATIENCE)
    wait_until(lambda: time.monotonic() > gateway.reporter.next_beat + 5 * BEAT, "heartbeats to be left out")
    goes_on.set()
    wait_until(lambda: gateway.reporter.next_beat > time.monotonic(), "heartbeats to go on")
    assert running.http.get("/hosts").status_code == 200
