from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.gateway.conftest import Running

JSON = {"Content-Type": "application/json"}
SLOWER: dict[str, Any] = {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 0.1}}

plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)
few = settings(max_examples=30, deadline=None)


@pytest.mark.parametrize(
    "body",
    [
        b"{",
        b"",
        b"[]",
        b"null",
        b'"text"',
        b"\xff\xfe",
        b'{"changes": [], "changes": []}',
        b'{"reason": NaN, "changes": []}',
        b'{"reason": "\\ud800", "changes": []}',
        b'{"context": {"light": 1e999}, "changes": []}',
        b'{"context": {"light": -1e999}, "changes": []}',
        b'{"reason": ' + b"[" * 100_000,
        b'{"revision": ' + b"9" * 5000 + b', "changes": []}',
        b'{"revision": 99999999999999999999999, "changes": []}',
    ],
)
def test_what_is_no_json_object_is_a_problem(shared: Running, body: bytes) -> None:
    response = shared.http.post("/adaptations", content=body, headers=JSON)
    assert response.status_code == 422
    assert response.json()["violations"]


@pytest.mark.parametrize("digits", [400, 5000])
def test_a_number_of_many_digits_is_refused_as_too_large(shared: Running, digits: int) -> None:
    body = b'{"revision": ' + b"9" * digits + b', "changes": []}'
    answer = shared.http.post("/adaptations", content=body, headers=JSON).json()
    (violation,) = answer["violations"]
    assert f"({digits} digits), which is too large" in violation["problem"]


@pytest.mark.parametrize("name", ["{}", "twice{}"], ids=["others", "twice"])
def test_an_object_of_60000_names_is_refused_and_keeps_nobody_waiting(shared: Running, name: str) -> None:
    names = [name.format(number if name == "{}" else number % 30_000) for number in range(60_000)]
    body = "{" + ",".join(f'"{one}":0' for one in names) + "}"
    response = shared.http.post("/adaptations", content=body, headers=JSON)
    assert response.status_code == 422
    assert len(response.json()["violations"]) <= 101
    assert len(response.content) < 40_000


def test_a_body_that_is_not_json_is_not_read(shared: Running) -> None:
    for content_type in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data", ""):
        response = shared.http.post("/adaptations", content=b"{}", headers={"Content-Type": content_type})
        assert response.status_code == 415
    assert shared.http.post("/adaptations").status_code == 415


def test_every_misfit_of_an_adaptation_is_told(shared: Running) -> None:
    body = {
        "reason": 7,
        "actor": "me",
        "revision": -1,
        "changes": [
            SLOWER,
            {"change": "explode", "component": "navigator"},
            {**SLOWER, "parameter": {}},
            {"change": "transition", "component": "navigator"},
        ],
    }
    asked = len(shared.manager.requests)
    response = shared.post("/adaptations", body)
    assert response.status_code == 422
    fields = {(v["field"], v["change"]) for v in response.json()["violations"]}
    assert fields == {
        ("actor", None),
        ("reason", None),
        ("revision", None),
        ("changes.1.change", 1),
        ("changes.2", 2),
        ("changes.3.transition", 3),
    }
    assert len(shared.manager.requests) == asked


def test_misfits_of_body_query_and_headers_are_told_together(shared: Running) -> None:
    path = "/components/navigator/swap?dry_run=perhaps"
    body = {"class": 7, "component": "detector", "with_stat": False}
    answer = shared.post(path, body, headers={"Idempotency-Key": "x" * 201}).json()
    told = {violation["field"]: violation["problem"] for violation in answer["violations"]}
    assert told.keys() == {"class", "component", "with_stat", "dry_run", "idempotency-key"}
    assert told["class"] == "is int, must be text"
    assert told["component"] == "is named by the path"
    assert "did you mean 'with_state'?" in told["with_stat"]


@pytest.mark.parametrize("changes", [None, [], {}, "set_parameters", [SLOWER] * 1001])
def test_changes_are_a_bounded_list(shared: Running, changes: Any) -> None:
    assert shared.post("/adaptations", {"changes": changes}).json()["violations"][0]["field"] == "changes"
    assert shared.post("/adaptations", {}).json()["violations"][0]["field"] == "changes"


def test_values_too_deep_to_travel_are_refused(shared: Running) -> None:
    value: Any = 1.0
    for _ in range(14):
        value = [value]
    change = {**SLOWER, "parameters": {"max_velocity": value}}
    assert shared.post("/adaptations", {"changes": [change]}).status_code == 422


def test_unknown_routes_and_methods_are_problems(shared: Running) -> None:
    missing = shared.http.get("/nothing")
    assert missing.status_code == 404
    assert missing.headers["content-type"] == "application/problem+json"
    wrong = shared.http.put("/adaptations", json={})
    assert wrong.status_code == 405
    assert "POST" in wrong.headers["allow"]
    assert wrong.headers["content-type"] == "application/problem+json"


@few
@given(body=plain)
def test_no_body_makes_the_gateway_fail(shared: Running, body: Any) -> None:
    sent: dict[str, Any] = {"content": json.dumps(body), "headers": JSON}
    assert shared.http.post("/adaptations", **sent).status_code == 422
    assert shared.http.patch("/components/navigator/parameters", **sent).status_code in (200, 409, 422)
    assert shared.http.post("/components/navigator/transition", **sent).status_code == 422
    assert shared.http.post("/mission/load", **sent).status_code in (409, 422)


@few
@given(values=st.dictionaries(st.text(), plain, max_size=3), field=st.sampled_from(list(SLOWER)), value=plain)
def test_no_change_makes_the_gateway_fail(shared: Running, values: Any, field: str, value: Any) -> None:
    for change in ({**SLOWER, "parameters": values}, {**SLOWER, field: value}):
        assert shared.post("/adaptations", {"changes": [change]}).status_code in (200, 409, 422)


@few
@given(
    query=st.dictionaries(st.sampled_from(["before", "limit", "revision", "from", "to", "lines"]), st.text()),
    header=st.text(st.characters(min_codepoint=32, max_codepoint=126)),
)
def test_no_query_or_header_makes_the_gateway_fail(shared: Running, query: dict[str, str], header: str) -> None:
    for path in ("/adaptations", "/architecture", "/architecture/diff", "/components/navigator/logs"):
        assert shared.http.get(path, params=query).status_code in (200, 404, 422)
    names = ("If-Match", "Idempotency-Key", "Prefer", "X-Regraft-Actor", "If-None-Match", "Content-Type")
    for name in names:
        response = shared.post("/adaptations", {"changes": [SLOWER]}, headers={name: header.strip()})
        assert response.status_code in (200, 202, 409, 412, 415, 422)
        assert shared.http.get("/architecture", headers={name: header.strip()}).status_code in (200, 304)
