"""Query parameters that a route does not have are refused: one that is misspelt would change what is done."""

from __future__ import annotations

from typing import Any

import pytest

from tests.gateway.conftest import Running

SLOWER: dict[str, Any] = {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 0.1}}


@pytest.mark.parametrize("name", ["dry-run", "dryrun", "Dry_Run"])
def test_an_adaptation_with_a_misspelt_parameter_is_not_carried_out(shared: Running, name: str) -> None:
    asked = len(shared.manager.requests)
    response = shared.post("/adaptations", {"changes": [SLOWER]}, params={name: "true"})
    assert (response.status_code, response.json()["type"]) == (422, "urn:regraft:problem:malformed")
    (violation,) = response.json()["violations"]
    assert violation["field"] == name
    assert "dry_run" in violation["problem"]
    assert len(shared.manager.requests) == asked


def test_a_parameter_that_is_given_twice_is_refused(shared: Running) -> None:
    asked = len(shared.manager.requests)
    response = shared.post("/adaptations?dry_run=true&dry_run=false", {"changes": [SLOWER]})
    assert response.status_code == 422
    assert [violation["field"] for violation in response.json()["violations"]] == ["dry_run"]
    assert len(shared.manager.requests) == asked


@pytest.mark.parametrize(
    ("method", "path", "meant"),
    [
        ("DELETE", "/mission/breakpoints?nodes=drive", "node"),
        ("POST", "/mission/halt?robots=scout", "robot"),
        ("PATCH", "/components/navigator/parameters?reson=near", "reason"),
        ("GET", "/components?robots=scout", "robot"),
        ("GET", "/architecture/diff?from=1&until=2", "to"),
        ("GET", "/mission/events?robots=scout", "robot"),
    ],
)
def test_every_route_names_the_parameters_that_it_has(shared: Running, method: str, path: str, meant: str) -> None:
    response = shared.http.request(method, path, json={} if method in ("POST", "PATCH") else None)
    assert response.status_code == 422
    assert meant in response.json()["violations"][0]["problem"]


@pytest.mark.parametrize("path", ["/system", "/events"])
def test_a_route_without_parameters_takes_none(shared: Running, path: str) -> None:
    response = shared.http.get(path, params={"robot": "scout"})
    assert response.status_code == 422
    assert [violation["field"] for violation in response.json()["violations"]] == ["robot"]
