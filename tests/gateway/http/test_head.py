from __future__ import annotations

import httpx
import pytest

from tests.gateway.conftest import Running
from tests.gateway.http.test_guard import raw
from tests.support.waiting import wait_until

PATHS = (
    *("/system", "/components", "/components/navigator", "/topics", "/hosts", "/architecture", "/adaptations"),
    *("/mission", "/planners", "/openapi.json", "/openapi.html", "/components/nobody", "/nothing", "/adaptations/77"),
)


@pytest.mark.parametrize("path", PATHS)
def test_head_answers_as_get_does_without_a_body(shared: Running, path: str) -> None:
    got, headed = shared.http.get(path), shared.http.head(path)
    assert headed.status_code == got.status_code
    assert headed.headers["content-type"] == got.headers["content-type"]
    assert headed.headers.get("etag") == got.headers.get("etag")
    assert headed.content == b""
    assert shared.http.get("/hosts").status_code == 200


def test_every_route_that_takes_get_takes_head(shared: Running) -> None:
    document = shared.http.get("/openapi.json").json()
    for path, item in document["paths"].items():
        if "get" in item:
            plain = path.removeprefix("/api/v1").replace("{id}", "1").replace("{name}", "navigator")
            answer = shared.http.head(plain)
            assert answer.status_code != 405, path
            refused = shared.http.request("PATCH" if "put" in item else "PUT", plain)
            assert (refused.status_code, "HEAD" in refused.headers["allow"]) == (405, True), path


@pytest.mark.parametrize("path", ["/events", "/mission/events"])
def test_head_of_a_stream_ends_and_leaves_no_reader(shared: Running, path: str) -> None:
    for _ in range(3):
        answer = shared.http.head(path)
        assert answer.status_code == 200
        assert answer.headers["content-type"].startswith("text/event-stream")
    request = f"HEAD /api/v1{path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode()
    assert raw(shared.url, request).endswith(b"\r\n\r\n")
    gateway = shared.site.runtimes["gateway"].component
    wait_until(lambda: gateway._buffer.readers == 0, "the readers to leave")  # type: ignore[attr-defined]


def test_head_acts_nowhere(shared: Running) -> None:
    answer = shared.http.head("/mission/halt")
    assert answer.status_code == 405
    with httpx.Client(base_url=shared.url) as http:
        assert http.head("/hosts", headers={"Host": "evil.example"}).status_code == 421
