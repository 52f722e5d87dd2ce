"""The gateway of a running system under bad manners: slow, many, deep, huge, and with names that are none."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import quote

import httpx
import pytest

from tests.hostile.components.test_bad_components import heard
from tests.hostile.conftest import SINK, SOURCE, Start
from tests.hostile.rest import Rest
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

SLOW_READERS = 200
NAMES = [
    "../../etc/passwd",
    "..%2f..%2fetc",
    "sink\0",
    "sink/../source",
    "*",
    "**",
    "\u0441ink",
    "\u202eknis",
    "a" * 5000,
    "sink?x=1",
    "#",
    " sink",
    "$*",
    "@",
]


@pytest.fixture(scope="module")
def shared(start_for_all: Start) -> Iterator[Rest]:
    with Rest(start_for_all, SOURCE + SINK) as rest:
        yield rest


@pytest.fixture
def rest(shared: Rest) -> Rest:
    assert shared.adapt("sink", {"delay": 0.0}).status_code == 200
    return shared


def _is_problem(answer: httpx.Response) -> bool:
    problem = answer.json()
    return (
        answer.headers["content-type"] == "application/problem+json"
        and {"type", "title", "status", "detail"} <= problem.keys()
        and problem["status"] == answer.status_code
        and bool(problem["detail"])
    )


def _goes_on(rest: Rest) -> None:
    before = heard(rest.system)
    wait_until(lambda: heard(rest.system) > before + 10, "the sink to hear more")
    assert rest.get("/system").status_code == 200
    rest.system.must_have_kept_all()


def test_hundreds_of_requests_at_once_are_all_answered(rest: Rest) -> None:
    paths = ("/system", "/components", "/components/sink", "/topics", "/hosts", "/architecture", "/components/nobody")
    alone = {"Connection": "close"}  # each request has a connection of its own

    def ask(number: int) -> int:
        return rest.client.get(paths[number % len(paths)], headers=alone, timeout=2 * PATIENCE).status_code

    with ThreadPoolExecutor(50) as pool:
        codes = list(pool.map(ask, range(300)))
    assert set(codes) <= {200, 404, 503}
    assert codes.count(200) > 200
    _goes_on(rest)


def test_adaptations_from_many_at_once_are_all_decided(rest: Rest) -> None:
    with ThreadPoolExecutor(30) as pool:
        answers = list(pool.map(lambda n: rest.adapt("sink", {"delay": n / 10_000}), range(60)))
    assert {answer.status_code for answer in answers} <= {200, 409, 429, 503}
    assert all(answer.status_code == 200 or _is_problem(answer) for answer in answers)
    assert rest.adapt("sink", {"delay": 0.0}).status_code == 200
    _goes_on(rest)


def test_clients_that_send_byte_by_byte_keep_nobody_waiting(rest: Rest) -> None:
    slow = [socket.create_connection(("127.0.0.1", rest.port)) for _ in range(SLOW_READERS)]
    try:
        begin = b"POST /api/v1/adaptations HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100000\r\nX: "
        for part in (begin, b"a"):
            for connection in slow:
                with contextlib.suppress(ConnectionError):  # the oldest are closed to make room for others
                    connection.sendall(part)
        assert rest.get("/system").status_code == 200
        assert rest.adapt("sink", {"delay": 0.001}).status_code == 200
        _goes_on(rest)
    finally:
        for connection in slow:
            connection.close()


@pytest.mark.parametrize(
    "sent",
    [
        b"\x00" * 1000,
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET " + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 20_000 + b"\r\n",
        b"POST /api/v1/adaptations HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: -5\r\n\r\n",
        b"POST /api/v1/adaptations HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\nFFFFFFFF\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    ],
)
def test_what_is_no_http_is_sent_home(rest: Rest, sent: bytes) -> None:
    with socket.create_connection(("127.0.0.1", rest.port), timeout=PATIENCE) as connection:
        try:
            connection.sendall(sent)
            connection.shutdown(socket.SHUT_WR)
            answer = connection.recv(65536)
        except OSError:
            answer = b""
    assert not answer or answer.split()[1].startswith(b"4")
    _goes_on(rest)


def test_a_huge_adaptation_is_decided_as_a_whole(rest: Rest) -> None:
    good = {"change": "set_parameters", "component": "sink", "parameters": {"delay": 0.0001}}
    bad = {"change": "set_parameters", "component": "nobody", "parameters": {"delay": 1}}
    refused = rest.post([good] * 999 + [bad])
    assert 400 <= refused.status_code < 500
    assert _is_problem(refused)
    assert rest.system.client.view("sink").parameters["delay"] == 0.0
    many = rest.post([good] * 1000)
    assert many.status_code == 200 or _is_problem(many)
    _goes_on(rest)


@pytest.mark.parametrize("depth", [50, 1000, 100_000])
def test_json_nested_beyond_all_reason_is_a_problem(rest: Rest, depth: int) -> None:
    for opening, closing in (("[", "]"), ('{"a":', "}")):
        inner = opening * depth + "0" + closing * depth
        for body in (inner, f'{{"changes": {inner}}}', _setting(inner)):
            answer = rest.client.post("/adaptations", content=body, headers={"content-type": "application/json"})
            assert answer.status_code in (409, 413, 422), answer.text[:300]
            assert _is_problem(answer)
    _goes_on(rest)


def _setting(value: str) -> str:
    return f'{{"changes": [{{"change": "set_parameters", "component": "sink", "parameters": {{"delay": {value}}}}}]}}'


@pytest.mark.parametrize("value", ["NaN", "Infinity", "1e999", "-1", "2", '"fast"', "null", "[]", "true", "9" * 5000])
def test_a_value_that_does_not_fit_is_a_problem_and_touches_nothing(rest: Rest, value: str) -> None:
    answer = rest.client.post("/adaptations", content=_setting(value), headers={"content-type": "application/json"})
    assert answer.status_code in (409, 422), answer.text
    assert _is_problem(answer)
    assert "delay" in answer.text or "JSON" in answer.text
    assert rest.system.client.view("sink").parameters["delay"] == 0.0


@pytest.mark.parametrize("name", NAMES)
def test_a_name_that_is_none_is_a_problem(rest: Rest, name: str) -> None:
    for path in ("/components/{}", "/components/{}/logs", "/adaptations/{}", "/{}"):
        answer = rest.get(path.format(quote(name, safe="")))
        assert answer.status_code in (400, 404, 422), (path, answer.text[:300])
        assert _is_problem(answer)
    answer = rest.adapt(name, {"delay": 0.1})
    assert answer.status_code in (409, 422), answer.text[:300]
    assert _is_problem(answer)
    _goes_on(rest)
