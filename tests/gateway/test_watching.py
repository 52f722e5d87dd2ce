"""Adaptations over REST that are confirmed by conditions: every form, what broke, and what means nothing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import httpx
import pytest

from regraft.bus.interface import Answer
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.quality import Quality
from tests.adaptation.conditions import HOLDING, MALFORMED, UNKNOWN
from tests.adaptation.system import SYSTEM, System, small_architecture, spec_of
from tests.adaptation.watching.gauging import Gauge
from tests.gateway.real_manager import served
from tests.support.tables import check_each
from tests.support.waiting import PATIENCE, wait_until

GAUGE = "tests.adaptation.watching.gauging:Gauge"
LOW = {"change": "set_parameters", "component": "gauge", "parameters": {"shown": 1.0}}
LOUDER = {"change": "set_parameters", "component": "listener", "parameters": {"gain": 0.9}}
LEVEL = {"quality": "gauge.level", "at_least": 4}


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[System, httpx.Client]]:
    small = small_architecture()
    gauged = replace(small, components={**small.components, "gauge": spec_of("gauge", Gauge)})
    with served(gauged, tmp_path_factory.mktemp("watching")) as (system, http):
        wait_until(lambda: system.client.ask_measured("gauge").values, "a level")
        _tell(system, True)
        # The scanner answers for a requirement once its own thread has reported it.
        wait_until(lambda: _answers(system), "the requirement is answered for")
        yield system, http


def _tell(system: System, satisfied: bool) -> None:
    runtime = system.running["scanner"].runtime
    quality = Quality(1.0, "Steady", "Comfort", metric=0.25, satisfied=satisfied)
    runtime.post(lambda: runtime.component.kit.report_quality(quality))


def _answers(system: System) -> list[Answer]:
    return system.running["scanner"].bus.query(Keys(SYSTEM).quality("Steady"), b"", PATIENCE)


def _shown(system: System) -> Any:
    return system.view("gauge").parameters["shown"]


def test_every_form_is_taken_and_what_holds_is_applied(both: Any) -> None:
    _, http = both
    answer = http.post("/adaptations", json={"changes": [LOUDER], "confirm": 0.3, "watch": list(HOLDING)})
    assert answer.status_code == 200, answer.text
    body = answer.json()
    assert (body["outcome"], body["broken"]) == ("applied", [])
    assert len(body["request"]["watch"]) == len(HOLDING)


BROKEN: dict[str, tuple[str, dict[str, Any], Any, str, str, float | None]] = {
    "adaptation": ("/adaptations", {"changes": [LOW]}, LEVEL, "quality_out_of_bounds", "gauge.level", 1.0),
    "swap": (
        "/components/gauge/swap",
        {"class": GAUGE, "parameters": {"shown": 2.0}},
        {"quality": "gauge.level", "within": [4, 10]},
        "quality_out_of_bounds",
        "gauge.level",
        2.0,
    ),
    "expression": (
        "/adaptations",
        {"changes": [LOW]},
        {"require": "gauge.level > 4"},
        "expression_false",
        "gauge.level > 4",
        None,
    ),
    "unknown": (
        "/adaptations",
        {"changes": [{**LOW, "parameters": {"works": False}}]},
        {**LEVEL, "unknown_for": 0.1},
        "quality_unknown",
        "gauge.level",
        None,
    ),
    "state": (
        "/components/second/transition",
        {"transition": "deactivate"},
        {"component": "second", "state": "active"},
        "wrong_state",
        "",
        None,
    ),
}


@pytest.mark.parametrize("case", BROKEN)
def test_what_broke_is_in_the_answer_and_is_undone(both: Any, case: str) -> None:
    system, http = both
    path, body, condition, code, subject, value = BROKEN[case]
    before = {name: view[1:] for name, view in system.views().items()}
    answer = http.post(
        path, json={**body, "confirm": 0.6, "watch": [{"component": "gauge", "state": "active"}, condition]}
    )
    assert (answer.status_code, answer.headers["content-type"]) == (409, "application/problem+json")
    problem = answer.json()
    assert problem["type"] == "urn:regraft:problem:rolled-back"
    report = problem["report"]
    (broken,) = report["broken"]
    assert (broken["code"], broken["watch"], broken["subject"], broken["value"]) == (code, 1, subject, value), broken
    assert report["outcome"] == "rolled_back"
    assert report["error"] == f"not confirmed: {broken['text']}"
    line = http.get(f"/adaptations/{report['id']}").json()
    assert line["broken"] == report["broken"]
    assert {name: view[1:] for name, view in system.views().items()} == before


def test_a_requirement_that_breaks_is_in_the_answer_and_is_undone(both: Any) -> None:
    system, http = both
    asked = {"changes": [LOW], "confirm": 60, "watch": ["Steady"]}
    pending = http.post("/adaptations", json=asked, headers={"Prefer": "respond-async"})
    assert pending.status_code == 202
    place = pending.headers["location"]

    def line() -> dict[str, Any]:
        found: dict[str, Any] = http.get(place.removeprefix("/api/v1")).json()
        return found

    wait_until(lambda: line()["outcome"] == "confirming", "it to be confirmed")
    assert _shown(system) == 1.0
    _tell(system, False)
    wait_until(lambda: line()["outcome"] != "confirming", "its end")
    ended = line()
    _tell(system, True)
    (broken,) = ended["broken"]
    assert (ended["outcome"], broken["code"], broken["subject"]) == ("rolled_back", "requirement_broken", "Steady")
    assert _shown(system) == 5.0


def test_an_undo_is_watched_too(both: Any) -> None:
    system, http = both
    done = http.post("/adaptations", json={"changes": [{**LOW, "parameters": {"shown": 9.0}}]}).json()
    body = {"confirm": 0.3, "watch": [{"quality": "gauge.level", "at_least": 8}]}
    answer = http.post(f"/adaptations/{done['id']}/undo", json=body)
    assert (answer.status_code, answer.json()["report"]["broken"][0]["value"]) == (409, 5.0)
    assert _shown(system) == 9.0
    assert http.post(f"/adaptations/{done['id']}/undo").status_code == 200


BODIES: dict[str, dict[str, Any]] = {
    "/adaptations": {"changes": [LOUDER]},
    "/components/gauge/swap": {"class": GAUGE},
    "/components/gauge/transition": {"transition": "deactivate"},
    "/components/gauge/move": {"host": "local"},
    "/adaptations/1/undo": {},
}


def test_a_condition_that_means_nothing_is_refused_by_field_in_every_body_that_takes_one(both: Any) -> None:
    system, http = both
    before = system.lines().entries

    def check(row: tuple[str, tuple[Any, str, str]]) -> None:
        path, (plain, where, problem) = row
        body = json.dumps({**BODIES[path], "confirm": 1, "watch": ["Steady", plain]})
        answer = http.post(path, content=body, headers={"content-type": "application/json"})
        assert answer.status_code == 422, (path, plain, answer.text)
        found = answer.json()["violations"]
        field = ".".join(filter(None, ("watch.1", where)))
        assert any(one["field"] == field and problem in one["problem"] for one in found), (path, plain, answer.text)

    finite = [row for row in MALFORMED if "NaN" not in json.dumps(row[0])]
    check_each([("/adaptations", row) for row in finite] + [(path, finite[2]) for path in BODIES], check)
    assert system.lines().entries == before


def test_a_number_that_is_none_is_no_json(both: Any) -> None:
    _, http = both
    body = '{"changes": [], "confirm": 1, "watch": [{"quality": "a.b", "at_least": NaN}]}'
    assert http.post("/adaptations", content=body, headers={"content-type": "application/json"}).status_code == 422


def test_a_condition_over_what_is_not_there_is_a_violation_with_the_nearest_name(both: Any) -> None:
    system, http = both
    before = system.views()

    def check(row: tuple[Any, str, str]) -> None:
        plain, where, problem = row
        answer = http.post("/adaptations", json={"changes": [LOUDER], "confirm": 1, "watch": ["Steady", plain]})
        assert (answer.status_code, answer.json()["type"]) == (409, "urn:regraft:problem:rejected"), answer.text
        (violation,) = answer.json()["violations"]
        assert violation["field"] == ".".join(filter(None, ("watch.1", where)))
        assert problem in violation["problem"]

    check_each(UNKNOWN, check)
    assert system.views() == before
