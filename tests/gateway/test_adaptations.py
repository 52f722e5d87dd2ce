from __future__ import annotations

import os
import threading
from dataclasses import replace
from typing import Any

import pytest

from regraft import RefusalCode, RequestRefused
from regraft.bus_schema.model.adaptation import Outcome, Swap
from regraft.bus_schema.model.watched import Condition
from regraft.dashboard_api.http.authentication import user_name
from tests.gateway.conftest import Running
from tests.support.waiting import PATIENCE, wait_until

SLOWER = {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 0.18}}


def adaptation(*changes: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"reason": "someone is near", "changes": list(changes or (SLOWER,)), **more}


def test_an_applied_adaptation_answers_with_its_report(running: Running) -> None:
    response = running.post("/adaptations", adaptation())
    assert response.status_code == 200
    report = response.json()
    assert (report["outcome"], report["revision_after"]) == ("applied", 2)
    assert response.headers["location"] == "/api/v1/adaptations/1"
    assert running.http.get("/adaptations/1").json() == report
    assert running.http.get("/architecture").headers["etag"].startswith('"2-')


def test_a_port_is_disconnected_by_a_topic_that_is_null(running: Running) -> None:
    change = {"change": "connect", "component": "drive", "port": "velocity", "topic": None}
    response = running.post("/adaptations", adaptation(change))
    assert response.json()["request"]["changes"] == [change]
    without = running.post("/adaptations", adaptation({**change, "topic": 7}, {**change, "port": None}))
    assert without.status_code == 422
    assert {violation["field"] for violation in without.json()["violations"]} == {
        "changes.0.topic",
        "changes.1.port",
    }
    del change["topic"]
    left_out = running.post("/adaptations", adaptation(change))
    assert (left_out.status_code, left_out.json()["violations"][0]["field"]) == (422, "changes.0.topic")


def test_who_asked_is_told_to_the_journal(running: Running) -> None:
    running.post("/adaptations", adaptation())
    running.post("/adaptations", adaptation(), headers={"X-Regraft-Actor": ("Åda\u200b\x85 " + "x" * 300).encode()})
    first, second = running.manager.requests
    own = user_name(os.geteuid())
    assert first.actor == own
    assert second.actor.startswith(f"{own}: Åda x")
    assert len(second.actor) == len(f"{own}: ") + 100


def test_the_context_of_a_decision_is_kept_in_the_journal(running: Running) -> None:
    context = {"qualities": {"MoveSafely": {"metric": 0.4}}, "node": "adapt"}
    assert running.post("/adaptations", adaptation(context=context)).status_code == 200
    assert running.http.get("/adaptations/1").json()["request"]["context"] == context
    assert running.http.get("/adaptations").json()["entries"][0]["request"]["context"] == context


@pytest.mark.parametrize("context", [7, ["a"], {"picture": "x" * 20_000}])
def test_a_context_that_is_no_map_or_too_large_is_refused(shared: Running, context: Any) -> None:
    asked = len(shared.manager.requests)
    response = shared.post("/adaptations", adaptation(context=context))
    assert response.status_code == 422
    assert [violation["field"] for violation in response.json()["violations"]] == ["context"]
    assert len(shared.manager.requests) == asked


def test_a_rejected_adaptation_names_every_violation(running: Running) -> None:
    nobody = {"change": "connect", "component": "nobody", "port": "image", "topic": "scan"}
    typo = {"change": "set_parameters", "component": "navigator", "parameters": {"max_speed": 1}}
    response = running.post("/adaptations", adaptation(nobody, typo))
    assert response.status_code == 409
    problem = response.json()
    assert problem["type"] == "urn:regraft:problem:rejected"
    assert [(v["change"], v["component"], v["field"]) for v in problem["violations"]] == [
        (0, "nobody", "component"),
        (1, "navigator", "parameters.max_speed"),
    ]
    assert problem["report"]["outcome"] == "rejected"


@pytest.mark.parametrize(
    ("fate", "status", "slug"),
    [
        (Outcome.ROLLED_BACK, 409, "rolled-back"),
        (Outcome.CANCELLED, 409, "cancelled"),
        (Outcome.STUCK, 500, "stuck"),
    ],
)
def test_what_went_wrong_comes_with_the_report(running: Running, fate: Outcome, status: int, slug: str) -> None:
    running.manager.fate = fate
    response = running.post("/adaptations", adaptation())
    assert response.status_code == status
    problem = response.json()
    assert problem["type"] == f"urn:regraft:problem:{slug}"
    assert problem["report"]["outcome"] == fate.value
    assert "navigator did not answer" in problem["detail"]


def test_a_dry_run_shows_plan_and_result_and_touches_nothing(shared: Running) -> None:
    response = shared.post("/adaptations?dry_run=true", adaptation())
    assert response.status_code == 200
    report = response.json()
    assert [step["state"] for step in report["steps"]] == ["planned"]
    assert report["architecture"]["components"]["navigator"]["parameters"] == {"max_velocity": 0.18}
    assert shared.http.get("/architecture").headers["etag"].startswith('"1-')


def test_a_stale_revision_fails_the_precondition(running: Running) -> None:
    assert running.post("/adaptations", adaptation(), headers={"If-Match": '"1"'}).status_code == 200
    stale = running.post("/adaptations", adaptation(), headers={"If-Match": '"1"'})
    assert stale.status_code == 412
    assert stale.json()["violations"][0]["field"] == "revision"
    assert running.post("/adaptations", adaptation(), headers={"If-Match": "*"}).status_code == 200
    assert running.post("/adaptations", adaptation(revision=1)).status_code == 409
    assert running.post("/adaptations", adaptation(), headers={"If-Match": "two"}).status_code == 422
    assert running.post("/adaptations", adaptation(revision=2), headers={"If-Match": '"3"'}).status_code == 422


def test_the_same_idempotency_key_is_the_same_adaptation(running: Running) -> None:
    key = {"Idempotency-Key": "4f2a"}
    first = running.post("/adaptations", adaptation(), headers=key).json()
    again = running.post("/adaptations", adaptation(), headers=key).json()
    assert first == again
    other = running.post("/adaptations", {**adaptation(), "reason": "another"}, headers=key)
    assert other.status_code == 422
    assert other.json()["type"] == "urn:regraft:problem:idempotency-key-reused"
    assert running.post("/adaptations", adaptation(), headers={"Idempotency-Key": "x" * 201}).status_code == 422


def test_respond_async_answers_at_once_with_where_to_look(running: Running) -> None:
    response = running.post("/adaptations", adaptation(), headers={"Prefer": "respond-async, wait=10"})
    assert response.status_code == 202
    assert response.json()["outcome"] == "pending"
    path = response.headers["location"].removeprefix("/api/v1")
    assert running.http.get(path).json()["outcome"] == "pending"


def test_an_adaptation_is_cancelled_once(running: Running) -> None:
    running.post("/adaptations", adaptation(), headers={"Prefer": "respond-async"})
    response = running.http.delete("/adaptations/1")
    assert response.status_code == 200
    assert response.json()["outcome"] == "cancelled"
    again = running.http.delete("/adaptations/1")
    assert again.status_code == 409
    assert "has ended" in again.json()["detail"]
    assert running.http.delete("/adaptations/77").status_code == 404


def test_undoing_is_an_adaptation(running: Running) -> None:
    running.post("/adaptations", adaptation())
    response = running.post("/adaptations/1/undo", {"reason": "it was better"}, headers={"X-Regraft-Actor": "ada"})
    assert response.status_code == 200
    request = response.json()["request"]
    assert (request["undoes"], request["reason"], request["actor"]) == (
        "1",
        "it was better",
        f"{user_name(os.geteuid())}: ada",
    )
    assert running.http.post("/adaptations/1/undo").status_code == 200
    assert running.http.post("/adaptations/77/undo").status_code == 404
    assert running.post("/adaptations/1/undo", {"because": "it was better"}).status_code == 422


def test_an_undo_can_be_tried(running: Running) -> None:
    running.post("/adaptations", adaptation())
    tried = running.http.post("/adaptations/1/undo?dry_run=true")
    assert tried.status_code == 200
    assert tried.json()["request"] | {"dry_run": True, "undoes": "1"} == tried.json()["request"]
    assert "Location" not in tried.headers
    assert [line["id"] for line in running.http.get("/adaptations").json()["entries"]] == ["1"]
    assert running.http.post("/adaptations/77/undo?dry_run=true").status_code == 404
    assert running.http.post("/adaptations/1/undo?dry_run=perhaps").status_code == 422


def test_what_was_not_applied_cannot_be_undone(running: Running) -> None:
    running.manager.fate = Outcome.ROLLED_BACK
    running.post("/adaptations", adaptation())
    assert running.http.post("/adaptations/1/undo").status_code == 409


def test_the_journal_has_those_that_wait_for_their_turn(running: Running) -> None:
    running.post("/adaptations", adaptation())
    (line,) = running.manager.journal_lines
    running.manager.waiting = (replace(line, id="2", outcome=Outcome.PENDING),)
    page = running.http.get("/adaptations").json()
    assert [[entry["id"] for entry in page[name]] for name in ("waiting", "entries")] == [["2"], ["1"]]
    assert running.http.get("/adaptations?before=2").json()["waiting"] == []


def test_the_journal_is_read_page_by_page(running: Running) -> None:
    for _ in range(5):
        running.post("/adaptations", adaptation())
    first = running.http.get("/adaptations?limit=2").json()
    second = running.http.get(f"/adaptations?limit=2&before={first['next']}").json()
    third = running.http.get(f"/adaptations?limit=2&before={second['next']}").json()
    pages = [[entry["id"] for entry in page["entries"]] for page in (first, second, third)]
    assert pages == [["5", "4"], ["3", "2"], ["1"]]
    assert third["next"] is None
    assert running.http.get("/adaptations?limit=501").status_code == 422
    assert running.http.get("/adaptations/77").status_code == 404


def test_a_silent_manager_is_unavailable_within_the_bound(running: Running) -> None:
    running.impatient()
    running.manager.silent = True
    response = running.post("/adaptations", adaptation())
    assert response.status_code == 503
    assert response.headers["retry-after"]
    assert "may still happen" in response.json()["detail"]
    assert running.http.get("/adaptations").status_code == 503


def test_a_manager_that_is_not_there_is_unavailable(running: Running) -> None:
    running.impatient()
    running.site.stop("adaptation_manager")
    wait_until(lambda: not running.site.bus.present(running.site.keys.alive("adaptation_manager", "*"), 1.0))
    assert running.post("/adaptations", adaptation()).status_code == 503


def test_a_manager_that_cannot_work_now_is_unavailable(running: Running) -> None:
    running.post("/adaptations", adaptation())
    running.manager.refusal = RequestRefused("the disk is full", RefusalCode.UNAVAILABLE)
    response = running.post("/adaptations", adaptation())
    assert response.status_code == 503
    assert response.json()["detail"] == "the disk is full"
    running.manager.unreadable = True
    assert running.http.get("/adaptations").status_code == 503
    assert running.http.post("/adaptations/1/undo").status_code == 503


def test_many_that_wait_for_their_adaptation_leave_room_for_others(running: Running) -> None:
    running.manager.silent = True
    statuses: list[int] = []
    refusals: list[str] = []

    def ask() -> None:
        with running.connect() as http:
            response = http.post("/adaptations", json=adaptation(), timeout=2 * PATIENCE)
            statuses.append(response.status_code)
            if response.status_code == 429:
                assert response.headers["retry-after"] == "1"
                refusals.append(response.json()["detail"])

    threads = [threading.Thread(target=ask) for _ in range(24)]
    for thread in threads:
        thread.start()
    wait_until(lambda: len(running.manager.requests) == 16 and len(refusals) == 8)
    assert running.http.get("/hosts").status_code == 200
    assert "16 requests are waiting" in refusals[0]
    running.manager.silent = False
    for thread in threads:
        thread.join(PATIENCE)
    assert sorted(statuses) == [200] * 16 + [429] * 8


def test_setting_parameters_is_an_adaptation(running: Running) -> None:
    response = running.http.patch("/components/navigator/parameters?reason=near", json={"max_velocity": 0.1})
    assert response.status_code == 200
    request = response.json()["request"]
    assert request["reason"] == "near"
    assert request["changes"] == [
        {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 0.1}}
    ]
    assert running.http.patch("/components/navigator/parameters", json={"max_speed": 1}).status_code == 409
    stale = running.http.patch("/components/navigator/parameters", json={}, headers={"If-Match": '"1"'})
    assert stale.status_code == 412


def test_a_transition_is_an_adaptation(running: Running) -> None:
    response = running.post("/components/navigator/transition", {"transition": "deactivate", "reason": "dark"})
    assert response.status_code == 200
    assert running.http.get("/components/navigator").json()["spec"]["state"] == "inactive"
    wrong = running.post("/components/navigator/transition", {"transition": "sleep"})
    assert wrong.status_code == 422
    assert "deactivate" in wrong.json()["detail"]
    assert running.post("/components/navigator/transition", {}).status_code == 422


def test_a_swap_is_an_adaptation(running: Running) -> None:
    body = {"class": "elsewhere:Navigator", "parameters": {"max_velocity": 0.1}, "with_state": False, "reason": "newer"}
    response = running.post("/components/navigator/swap", body)
    assert response.status_code == 200
    assert running.http.get("/components/navigator").json()["spec"]["class"] == "elsewhere:Navigator"
    (change,) = running.manager.requests[-1].changes
    assert change == Swap("navigator", "elsewhere:Navigator", {"max_velocity": 0.1}, with_state=False)
    assert running.post("/components/navigator/swap?dry_run=true", {}).json()["outcome"] == "pending"
    wrong = running.post("/components/navigator/swap", {"class": 7, "component": "detector"})
    assert wrong.status_code == 422
    assert running.post("/components/nobody/swap", {}).status_code == 404


def test_a_move_is_an_adaptation(running: Running) -> None:
    assert running.post("/components/navigator/move", {"host": "second"}).status_code == 200
    assert running.http.get("/components/navigator").json()["spec"]["host"] == "second"
    assert running.post("/components/navigator/move", {}).status_code == 422


@pytest.mark.parametrize("name", ["nobody", "not a name", "..", "a.b.c"])
def test_what_is_not_there_cannot_be_changed(shared: Running, name: str) -> None:
    assert shared.http.patch(f"/components/{name}/parameters", json={}).status_code in (404, 405)
    assert shared.post(f"/components/{name}/transition", {"transition": "configure"}).status_code in (404, 405)


def test_an_adaptation_can_be_watched_before_it_is_final(running: Running) -> None:
    response = running.post("/adaptations", adaptation(confirm=5, watch=["MoveSafely"]))
    assert response.status_code == 200
    (request,) = running.manager.requests
    assert (request.confirm, request.watch) == (5.0, (Condition("MoveSafely"),))


@pytest.mark.parametrize(("field", "value"), [("confirm", -1), ("confirm", "soon"), ("watch", "MoveSafely")])
def test_a_confirmation_that_cannot_be_is_refused(running: Running, field: str, value: Any) -> None:
    response = running.post("/adaptations", adaptation(**{field: value}))
    assert response.status_code == 422
    assert response.json()["violations"][0]["field"].startswith(field)


def test_one_that_is_being_confirmed_is_confirmed_or_cancelled(running: Running) -> None:
    running.manager.fate = Outcome.CONFIRMING
    for number, (ask, outcome) in enumerate([("confirm", "applied"), ("cancel", "cancelled")], start=1):
        response = running.post("/adaptations", adaptation(confirm=60), headers={"Prefer": "respond-async"})
        assert (response.status_code, response.json()["outcome"]) == (202, "confirming")
        path = f"/adaptations/{number}"
        response = running.post(f"{path}/confirm") if ask == "confirm" else running.http.delete(path)
        assert (response.status_code, response.json()["outcome"]) == (200, outcome)
        refused = running.post(f"{path}/confirm")
        assert (refused.status_code, refused.json()["type"]) == (409, "urn:regraft:problem:conflict")
    assert running.post("/adaptations/99/confirm").status_code == 404
