"""Adaptations over REST, carried out by the real adaptation manager."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.adaptation.system import System, small_architecture
from tests.gateway.real_manager import served
from tests.support.waiting import PATIENCE, wait_until


@pytest.fixture
def real(tmp_path: Path) -> Iterator[tuple[System, httpx.Client]]:
    """Return a small system with its manager, and a client of its gateway."""
    with served(small_architecture(), tmp_path) as made:
        yield made


def gain(value: float, **more: Any) -> dict[str, Any]:
    """Return the body of an adaptation that sets the listener's gain."""
    change = {"change": "set_parameters", "component": "listener", "parameters": {"gain": value}}
    return {"changes": [change], **more}


@pytest.mark.parametrize(("method", "path", "outcome"), [("DELETE", "", "cancelled"), ("POST", "/confirm", "applied")])
def test_an_adaptation_can_be_ended_while_all_places_to_wait_are_taken(
    real: tuple[System, httpx.Client], method: str, path: str, outcome: str
) -> None:
    _, http = real
    body, key = gain(0.1, confirm=600), {"Idempotency-Key": "the same"}
    answers: list[dict[str, Any]] = []
    refused = threading.Event()

    def wait_for_it() -> None:
        with httpx.Client(base_url=http.base_url, timeout=2 * PATIENCE) as other:
            response = other.post("/adaptations", json=body, headers=key)
        if response.status_code == 429:
            refused.set()
        else:
            answers.append(response.json())

    first = http.post("/adaptations", json=body, headers={**key, "Prefer": "respond-async"}).json()["id"]
    wait_until(lambda: http.get(f"/adaptations/{first}").json()["outcome"] == "confirming")
    threads = [threading.Thread(target=wait_for_it, daemon=True) for _ in range(17)]
    for thread in threads:
        thread.start()
    assert refused.wait(PATIENCE), "no request found all places taken"
    ended = http.request(method, f"/adaptations/{first}{path}")
    assert (ended.status_code, ended.json().get("outcome")) == (200, outcome)
    for thread in threads:
        thread.join(PATIENCE)
    assert len(answers) == 16


def test_a_dry_run_answers_with_what_was_checked_also_if_none_waits_for_it(real: tuple[System, httpx.Client]) -> None:
    _, http = real
    at_once = {"Prefer": "respond-async"}
    planned = http.post("/adaptations?dry_run=true", json=gain(0.1), headers=at_once)
    assert planned.status_code == 200
    assert [step["state"] for step in planned.json()["steps"]] == ["planned"]
    assert planned.json()["architecture"]["components"]["listener"]["parameters"]["gain"] == 0.1
    refused = http.post("/adaptations?dry_run=true", json=gain(7.0), headers=at_once)
    assert (refused.status_code, refused.json()["violations"][0]["field"]) == (409, "parameters.gain")


def test_an_undo_takes_the_headers_of_an_adaptation(real: tuple[System, httpx.Client]) -> None:
    _, http = real
    applied = http.post("/adaptations", json=gain(0.1)).json()["id"]
    path, key = f"/adaptations/{applied}/undo", {"Idempotency-Key": "the same"}
    stale = http.post(path, headers={"If-Match": '"1"'})
    assert (stale.status_code, stale.json()["type"]) == (412, "urn:regraft:problem:stale-revision")
    assert http.post(path, headers={"If-Match": "one"}).status_code == 422
    begun = http.post(path, headers={**key, "If-Match": '"2"', "Prefer": "respond-async"})
    assert (begun.status_code, begun.json()["outcome"]) == (202, "pending")
    undone = http.post(path, headers={**key, "If-Match": '"2"'})
    assert (undone.status_code, undone.json()["outcome"]) == (200, "applied")
    assert undone.headers["location"] == begun.headers["location"]
    assert http.post(path, headers={**key, "If-Match": '"2"'}).json() == undone.json()
    other = http.post(path, headers=key)
    assert (other.status_code, other.json()["type"]) == (422, "urn:regraft:problem:idempotency-key-reused")
