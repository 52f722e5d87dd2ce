"""Connections that only stay, and requests that only wait, lock nobody out of the gateway."""

from __future__ import annotations

import gc
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, suppress

import httpx
import pytest
from fastapi import FastAPI, Request, Response

from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.dashboard_api.http import client_connection
from regraft.dashboard_api.server import HttpServer, bind
from tests.gateway.conftest import start_gateway
from tests.support.stepped.site import Site
from tests.support.waiting import PATIENCE, wait_until

MOST = 8
ASK = b"GET /wait HTTP/1.1\r\nHost: localhost\r\n\r\n"


class Held:
    """How long requests to ``/wait`` take: until they are let go."""

    def __init__(self) -> None:
        self._gone = threading.Event()
        self._arrived = threading.Semaphore(0)

    def wait(self) -> None:
        """Wait as a request."""
        self._arrived.release()
        self._gone.wait(PATIENCE)

    def wait_arrived(self, count: int) -> None:
        """Wait until so many more requests wait."""
        for _ in range(count):
            assert self._arrived.acquire(timeout=PATIENCE)

    def let_go(self) -> None:
        """Have all requests answered."""
        self._gone.set()


@pytest.fixture
def held() -> Held:
    return Held()


@pytest.fixture
def server(held: Held) -> Iterator[HttpServer]:
    """A server that answers at once, or after a while."""
    app = FastAPI()

    @app.get("/")
    def answer() -> str:
        return "well"

    @app.get("/long")
    def much() -> Response:
        return Response(b"x" * 10_000_000)

    @app.post("/")
    async def take(request: Request) -> int:
        return len(await request.body())

    @app.get("/wait")
    def wait() -> str:
        held.wait()
        return "well"

    started = HttpServer(app, bind("127.0.0.1", 0))
    started.start()
    yield started
    held.let_go()
    assert started.stop()


def connect(server: HttpServer, begun: bytes = b"") -> socket.socket:
    """Connect, and send only the beginning of a request."""
    made = socket.create_connection(("127.0.0.1", server.port), PATIENCE)
    made.sendall(begun)
    return made


def is_well(server: HttpServer) -> bool:
    return httpx.get(f"{server.url}/", timeout=PATIENCE).text == '"well"'


HALF = b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 10\r\n\r\nhalf"


@pytest.mark.parametrize("begun", [b"", b"GET / HTTP/1.1\r\nHost: ", HALF])
def test_a_connection_that_does_not_finish_its_request_is_closed(
    server: HttpServer, monkeypatch: pytest.MonkeyPatch, begun: bytes
) -> None:
    monkeypatch.setattr(client_connection, "REQUEST_TIMEOUT", 1.0)
    with connect(server, begun) as silent:
        assert silent.recv(1) == b""
    assert is_well(server)


def test_the_head_of_a_further_request_has_its_time_too(server: HttpServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client_connection, "REQUEST_TIMEOUT", 1.0)
    with connect(server, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n") as slow:
        assert slow.recv(65536).startswith(b"HTTP/1.1 200")
        slow.sendall(b"GET / HTTP/1.1\r\n")
        rest = b"".join(iter(lambda: slow.recv(65536), b""))
        assert rest in (b"", b'"well"')


def test_a_request_that_is_being_answered_has_all_the_time(
    server: HttpServer, held: Held, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_connection, "REQUEST_TIMEOUT", 1.0)
    with connect(server, ASK) as waiting:
        held.wait_arrived(1)
        with connect(server) as silent:
            assert silent.recv(1) == b""
        held.let_go()
        assert waiting.recv(65536).startswith(b"HTTP/1.1 200")


def test_an_answer_that_nobody_reads_is_given_up(server: HttpServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client_connection, "READING_TIMEOUT", 0.5)
    with connect(server, b"GET /long HTTP/1.1\r\nHost: localhost\r\n\r\n") as idle:
        idle.settimeout(PATIENCE)
        wait_until(lambda: len(server.connections) == 0, "the connection to be given up")


def test_a_client_that_reads_slowly_but_steadily_gets_the_whole_answer(
    server: HttpServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_connection, "READING_TIMEOUT", 0.5)
    judged = threading.Semaphore(0)
    original = client_connection.KnownConnection._judge_reading

    def judge(connection: client_connection.KnownConnection, left: int) -> None:
        original(connection, left)
        judged.release()

    monkeypatch.setattr(client_connection.KnownConnection, "_judge_reading", judge)
    with socket.socket() as slow:
        slow.settimeout(PATIENCE)
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        slow.connect(("127.0.0.1", server.port))
        slow.sendall(b"GET /long HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        taken = 0
        for end in (200_000, 400_000, 600_000):
            while taken < end:
                taken += len(slow.recv(65536))
            assert judged.acquire(timeout=PATIENCE)
        taken += sum(len(part) for part in iter(lambda: slow.recv(65536), b""))
    assert taken > 10_000_000


@pytest.mark.parametrize("begun", [b"", HALF])
def test_unfinished_requests_make_room_for_others(
    server: HttpServer, monkeypatch: pytest.MonkeyPatch, begun: bytes
) -> None:
    monkeypatch.setattr(client_connection, "MAX_CONNECTIONS", MOST)
    monkeypatch.setattr(client_connection, "REQUEST_TIMEOUT", 10.0 * PATIENCE)
    with ExitStack() as stack:
        silent = [stack.enter_context(connect(server, begun)) for _ in range(10 * MOST)]
        assert is_well(server)
        wait_until(lambda: len(server.connections) <= MOST, "the oldest to be closed")
        with suppress(ConnectionResetError):
            assert silent[0].recv(1) == b""
        silent[-1].settimeout(0.1)
        with pytest.raises(TimeoutError):
            silent[-1].recv(1)


def test_a_client_that_was_answered_keeps_its_connection_though_others_only_connect(
    server: HttpServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_connection, "MAX_CONNECTIONS", MOST)
    monkeypatch.setattr(client_connection, "REQUEST_TIMEOUT", 10.0 * PATIENCE)
    with ExitStack() as stack, httpx.Client(base_url=server.url, timeout=PATIENCE) as client:
        assert client.get("/").text == '"well"'
        for _ in range(3 * MOST):
            stack.enter_context(connect(server))
        assert client.get("/").text == '"well"'


def test_connections_that_are_being_answered_are_kept_and_one_more_is_refused(
    server: HttpServer, held: Held, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_connection, "MAX_CONNECTIONS", MOST)
    monkeypatch.setattr(client_connection, "REQUEST_TIMEOUT", 10.0 * PATIENCE)
    with ExitStack() as stack:
        waiting = [stack.enter_context(connect(server, ASK)) for _ in range(MOST)]

        held.wait_arrived(MOST)
        with connect(server) as further:
            assert further.recv(1) == b""
        held.let_go()
        answered = [each.recv(65536) for each in waiting]
        assert [each[:12] for each in answered] == [b"HTTP/1.1 200"] * MOST


def test_as_many_requests_as_may_wait_leave_threads_for_others(server: HttpServer, held: Held) -> None:
    with ExitStack() as stack:
        for _ in range(48):
            stack.enter_context(connect(server, ASK))
        held.wait_arrived(48)
        assert is_well(server)


def test_a_gateway_that_is_deactivated_keeps_nothing_of_its_application(site: Site) -> None:
    def applications() -> int:
        gc.collect()
        return sum(isinstance(each, FastAPI) for each in gc.get_objects())

    url = start_gateway(site)
    gateway = site.runtimes["gateway"]
    before = applications()
    for _ in range(3):
        assert httpx.get(f"{url}/hosts", timeout=PATIENCE).status_code == 200
        gateway.post(lambda: gateway.lifecycle.perform(Transition.DEACTIVATE))
        wait_until(lambda: gateway.state is State.INACTIVE)
        gateway.post(lambda: gateway.lifecycle.perform(Transition.ACTIVATE))
        wait_until(lambda: gateway.state is State.ACTIVE)
        url = str(gateway.reporter.status.values["url"])
    assert applications() == before
