"""Whatever the OpenAPI document allows has the right form, and what it does not allow is refused."""

from __future__ import annotations

from collections.abc import Iterator

import httpx
import pytest

from tests.gateway.http.generated import attacked
from tests.hostile.conftest import SINK, SOURCE, Start
from tests.hostile.rest import Rest

pytestmark = pytest.mark.slow

EXAMPLES = 3


@pytest.fixture(scope="module")
def rest(start_for_all: Start) -> Iterator[Rest]:
    with Rest(start_for_all, SOURCE + SINK) as rest:
        yield rest


def test_no_request_that_the_document_allows_is_called_malformed_or_fails(rest: Rest) -> None:
    seen = list(attacked(f"http://127.0.0.1:{rest.port}", ["source", "sink"], EXAMPLES, 1))
    assert len(seen) > 30
    assert [wrong for one in seen for wrong in one.wrong] == []


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("POST", "adaptations"),
        ("POST", "components/source/qualities"),
        ("POST", "components/source/transition"),
        ("POST", "components/source/swap"),
        ("POST", "components/source/move"),
        ("POST", "mission/load"),
        ("POST", "mission/halt"),
    ],
)
def test_a_field_that_the_document_does_not_have_is_refused(rest: Rest, method: str, path: str) -> None:
    answer = httpx.request(method, f"http://127.0.0.1:{rest.port}/api/v1/{path}", json={"nonsense": 1}, verify=False)
    assert answer.status_code == 422
    assert "nonsense" in answer.json()["detail"]


@pytest.mark.parametrize("name", ["½", "a b", "x" * 300, "*"])
@pytest.mark.parametrize("part", ["", "/qualities", "/logs"])
def test_a_component_that_cannot_be_is_not_there(rest: Rest, name: str, part: str) -> None:
    url = f"http://127.0.0.1:{rest.port}/api/v1/components/{name}{part}"
    assert httpx.get(url, verify=False).status_code == 404
