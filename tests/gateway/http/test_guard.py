from __future__ import annotations

import asyncio
import socket
from contextlib import nullcontext
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from starlette.types import Message, Receive, Scope, Send

from regraft.dashboard_api.http.guard import Guard
from tests.gateway.conftest import Running
from tests.support.waiting import PATIENCE

ADAPTATION = {"changes": [{"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 0.1}}]}


def raw(url: str, request: bytes) -> bytes:
    """Return all that the server answers to bytes that no HTTP library would send."""
    parts = urlsplit(url)
    assert parts.hostname
    with socket.create_connection((parts.hostname, parts.port or 80), timeout=PATIENCE) as connection:
        connection.sendall(request)
        answer = b""
        while chunk := connection.recv(65536):
            answer += chunk
    return answer


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost:8000", "LOCALHOST", "[::1]:80", "127.8.8.8"])
def test_loopback_names_are_answered(shared: Running, host: str) -> None:
    assert shared.http.get("/hosts", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "localhost.evil.example", "192.0.2.7:8000", "0.0.0.0", "[::1", "evil@localhost.x", ""]
)
def test_a_rebound_host_name_is_refused(shared: Running, host: str) -> None:
    for method in ("GET", "POST"):
        response = shared.http.request(method, "/hosts", headers={"Host": host})
        assert response.status_code == 421
        assert response.headers["content-type"] == "application/problem+json"


def test_a_request_without_a_host_is_refused(shared: Running) -> None:
    assert raw(shared.url, b"GET /api/v1/hosts HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.1 421 ")


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://localhost:1"},
        {"Origin": "http://[::1"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"},
    ],
)
def test_a_page_of_another_origin_cannot_adapt(shared: Running, headers: dict[str, str]) -> None:
    response = shared.post("/adaptations", ADAPTATION, headers=headers)
    assert response.status_code == 403
    assert shared.http.post("/mission/halt", headers=headers).status_code == 403
    assert shared.manager.requests == []


def test_a_page_of_another_origin_cannot_read(shared: Running) -> None:
    assert shared.http.get("/hosts", headers={"Origin": "https://evil.example"}).status_code == 403
    assert shared.http.get("/hosts", headers={"Sec-Fetch-Site": "cross-site"}).status_code == 403


def test_the_own_page_and_a_followed_link_are_welcome(running: Running) -> None:
    origin = running.url.removesuffix("/api/v1")
    own = {"Origin": origin, "Sec-Fetch-Site": "same-origin"}
    assert running.post("/adaptations", ADAPTATION, headers=own).status_code == 200
    link = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
    assert running.http.get("/hosts", headers=link).status_code == 200


def closed_before_it_is_accepted(headers: dict[str, str]) -> list[Any] | None:
    """Return how a WebSocket with such headers is closed, None if it comes through to the application."""
    sent: list[Any] = []
    reached: list[Scope] = []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        reached.append(scope)

    async def receive() -> Message:
        return {"type": "websocket.connect"}

    async def send(message: Message) -> None:
        sent.append(message)

    raw_headers = [(name.lower().encode(), value.encode()) for name, value in headers.items()]
    scope = {"type": "websocket", "path": "/api/v1/watch", "headers": raw_headers}
    asyncio.run(Guard(app, "127.0.0.1")(scope, receive, send))
    assert bool(reached) != bool(sent)
    return None if reached else sent


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Host": "evil.example"},
        {"Host": "localhost:8000", "Origin": "https://evil.example"},
        {"Host": "localhost:8000", "Origin": "null"},
        {"Host": "localhost:8000", "Origin": "http://[::1"},
        {"Host": "localhost:8000", "Sec-Fetch-Site": "cross-site"},
        {"Host": "localhost:8000", "Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"},
    ],
)
def test_a_websocket_of_another_origin_or_host_is_closed_before_it_is_accepted(headers: dict[str, str]) -> None:
    closed = closed_before_it_is_accepted(headers)
    assert closed
    assert [(message["type"], message["code"]) for message in closed] == [("websocket.close", 1008)]


def test_a_websocket_of_the_own_page_or_of_a_program_comes_through() -> None:
    assert closed_before_it_is_accepted({"Host": "localhost:8000"}) is None
    own = {"Host": "localhost:8000", "Origin": "http://localhost:8000", "Sec-Fetch-Site": "same-origin"}
    assert closed_before_it_is_accepted(own) is None


@pytest.mark.parametrize(("kind", "passes"), [("lifespan", True), ("http3", False), ("", False)])
def test_a_connection_of_a_kind_that_is_not_known_is_refused(kind: str, passes: bool) -> None:
    reached: list[Scope] = []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        reached.append(scope)

    async def nothing(*_: Any) -> Any:
        raise AssertionError

    with nullcontext() if passes else pytest.raises(ValueError, match="is not served"):
        asyncio.run(Guard(app, "127.0.0.1")({"type": kind}, nothing, nothing))
    assert bool(reached) is passes


def test_no_other_origin_is_ever_allowed_in_advance(shared: Running) -> None:
    preflight = {"Origin": "https://evil.example", "Access-Control-Request-Method": "POST"}
    response = shared.http.options("/adaptations", headers=preflight)
    assert response.status_code == 403
    assert not any(name.startswith("access-control") for name in response.headers)


def test_a_huge_body_is_refused_by_its_announced_length(shared: Running) -> None:
    head = b"POST /api/v1/adaptations HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999\r\n"
    answer = raw(shared.url, head + b"Content-Type: application/json\r\nConnection: close\r\n\r\n")
    assert answer.startswith(b"HTTP/1.1 413 ")
    assert b"application/problem+json" in answer


def test_a_huge_body_is_refused_without_an_announced_length(shared: Running) -> None:
    chunks = (b" " * 65536 for _ in range(64))
    headers = {"Content-Type": "application/json"}
    try:
        response = shared.http.post("/adaptations", content=chunks, headers=headers)
    except httpx.WriteError:
        return  # the server has hung up on us before we had sent it all
    assert response.status_code == 413


def test_a_body_just_small_enough_is_read(shared: Running) -> None:
    body = b" " * (1024 * 1024 - 2) + b"{}"
    headers = {"Content-Type": "application/json"}
    assert shared.http.post("/adaptations", content=body, headers=headers).status_code == 422
    assert shared.http.post("/adaptations", content=b" " + body, headers=headers).status_code == 413


def test_answers_are_neither_cached_nor_guessed_at(shared: Running) -> None:
    headers = shared.http.get("/hosts").headers
    assert headers["cache-control"] == "no-store"
    assert headers["x-content-type-options"] == "nosniff"
    assert "server" not in headers
