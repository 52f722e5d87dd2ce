from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from regraft.bus_schema.model.lifecycle import State
from regraft.dashboard_api.gateway import Gateway
from tests.gateway.conftest import GATEWAY, Running, client
from tests.support.waiting import wait_for, wait_until


def test_the_system_is_shown_in_one_answer(shared: Running) -> None:
    system = shared.http.get("/system").json()
    assert system["system"] == "site"
    assert system["revision"] == 1
    assert system["simulated"] is False
    assert system["components"] == {"active": 5}
    assert system["hosts"] == ["local"]
    assert system["problems"] == []


def test_a_component_that_should_be_there_and_is_not_is_a_problem(running: Running) -> None:
    running.site.stop("drive")
    wait_until(lambda: running.site.runtimes["drive"].state is State.FINALIZED)
    wait_until(lambda: running.http.get("/system").json()["problems"] == ["drive should be active, but is not there"])


def test_components_are_shown_as_they_should_be_and_as_they_are(shared: Running) -> None:
    listed = shared.http.get("/components").json()
    assert listed["revision"] == 1
    navigator = next(line for line in listed["components"] if line["name"] == "navigator")
    assert (navigator["desired"], navigator["state"], navigator["alive"]) == ("active", "active", True)
    assert (navigator["host"], navigator["pid"]) == ("local", 4711)
    assert {line["name"] for line in listed["components"]} >= {"drive", "gateway", "adaptation_manager"}


def test_a_component_is_shown_with_its_live_parameters_and_connections(shared: Running) -> None:
    details = shared.http.get("/components/navigator").json()
    assert details["spec"]["parameters"] == {"max_velocity": 0.26}
    assert details["now"]["parameters"] == {"max_velocity": 0.26}
    assert details["now"]["connect"] == {"velocity": "velocity"}
    assert details["process"]["pid"] == 4711


def test_a_component_tells_its_qualities(shared: Running) -> None:
    url = "/components/navigator/qualities"
    assert shared.http.get(url).json()["estimated"] == {"speed": 0.26}
    assert shared.http.post(url, json={"parameters": {"max_velocity": 0.1}}).json()["estimated"] == {"speed": 0.1}
    refused = shared.http.post(url, json={"parameters": {"max_velocity": 9.0}})
    assert refused.status_code == 422
    assert "at most 0.26" in refused.json()["violations"][0]["problem"]
    assert shared.http.post(url, json={"colour": "red"}).status_code == 422
    assert shared.http.get("/components/nobody/qualities").status_code == 404


def test_measured_qualities_are_listed_with_their_declaration(shared: Running) -> None:
    def known() -> Any:
        (line,) = shared.http.get("/qualities").json()["qualities"]
        return line if line["value"] is not None else None

    line = wait_for(known, "a measured speed")
    assert (line["component"], line["quality"], line["value"]) == ("navigator", "speed", 0.13)
    assert (line["unit"], line["better"], line["minimum"], line["why"]) == ("m/s", "higher", 0.0, "")
    assert shared.http.get("/qualities", params={"robot": "nobody"}).status_code == 404


def test_an_unknown_component_is_not_found(shared: Running) -> None:
    response = shared.http.get("/components/nobody")
    assert response.status_code == 404
    assert "nobody" in response.json()["detail"]


def test_logs_come_from_the_components_host(shared: Running) -> None:
    assert shared.http.get("/components/navigator/logs?lines=2").json()["lines"] == ["line 998", "line 999"]
    assert shared.http.get("/components/drive/logs").status_code == 404
    assert shared.http.get("/components/navigator/logs?lines=0").status_code == 422


def test_topics_are_shown_with_their_writers_and_readers(shared: Running) -> None:
    (topic,) = shared.http.get("/topics").json()["topics"]
    assert topic["name"] == "velocity"
    assert (topic["writers"], topic["readers"]) == (["navigator.velocity"], ["drive.velocity"])


def test_hosts_are_shown_with_their_processes(shared: Running) -> None:
    (host,) = shared.http.get("/hosts").json()["hosts"]
    assert host["alive"]
    assert host["status"]["processes"][0]["component"] == "navigator"


def test_hosts_are_shown_with_what_they_offer_and_what_their_components_need(shared: Running) -> None:
    for query in ("", "?measured=true"):
        (host,) = shared.http.get(f"/hosts{query}").json()["hosts"]
        assert host["capability"]["devices"] == []
        cpu, memory = host["capability"]["amounts"]
        assert (cpu["name"], cpu["unit"], cpu["offered"], cpu["declared"]) == ("cpu", "cores", None, 0.0)
        assert (memory["name"], memory["measured"]) == ("memory", 9.5 if query else None)
    assert shared.http.get("/hosts?measured=perhaps").status_code == 422


def test_the_etag_of_the_architecture_begins_with_its_revision(shared: Running) -> None:
    response = shared.http.get("/architecture")
    tag = response.headers["etag"]
    assert tag.startswith('"1-')
    assert response.json()["revision"] == 1
    assert shared.http.get("/architecture", headers={"If-None-Match": tag}).status_code == 304
    assert shared.http.get("/architecture", headers={"If-None-Match": f'"0", W/{tag}'}).status_code == 304
    assert shared.http.get("/architecture", headers={"If-None-Match": '"0"'}).status_code == 200


def test_an_architecture_that_becomes_final_has_another_etag(running: Running) -> None:
    final = running.manager.current
    running.manager.revisions = {1: replace(final, unconfirmed="7")}
    tag = running.http.get("/architecture").headers["etag"]
    assert running.http.get("/architecture", headers={"If-None-Match": tag}).status_code == 304
    running.manager.revisions = {1: final}
    answer = running.http.get("/architecture", headers={"If-None-Match": tag})
    assert (answer.status_code, answer.json()["unconfirmed"]) == (200, "")
    change = {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 0.1}}
    assert running.post("/adaptations", {"changes": [change]}, headers={"If-Match": tag}).status_code == 200
    assert running.post("/adaptations", {"changes": [change]}, headers={"If-Match": tag}).status_code == 412


def test_the_same_revision_has_another_etag_in_another_run_of_a_gateway(running: Running) -> None:
    tag = running.http.get("/architecture").headers["etag"]
    running.site.start(Gateway, "following", parameters=GATEWAY)
    status = running.site.runtimes["following"].reporter.status
    with client(wait_for(lambda: status.values.get("url"), "its URL")) as http:
        answer = http.get("/architecture", headers={"If-None-Match": tag})
    assert (answer.status_code, answer.json()["revision"]) == (200, 1)


def test_former_revisions_can_be_read_and_compared(running: Running) -> None:
    assert running.http.patch("/components/navigator/parameters", json={"max_velocity": 0.1}).status_code == 200
    assert running.http.get("/architecture?revision=1").json()["revision"] == 1
    assert running.http.get("/architecture?revision=9").status_code == 404
    changed = running.http.get("/architecture/diff?from=1").json()
    assert (changed["before"], changed["after"]) == (1, 2)
    (difference,) = changed["differences"]
    assert difference == {
        "path": "/components/navigator/parameters/max_velocity",
        "kind": "changed",
        "before": 0.26,
        "after": 0.1,
    }
    back = running.http.get("/architecture/diff?from=2&to=1").json()["differences"]
    assert (back[0]["before"], back[0]["after"]) == (0.1, 0.26)


def test_overviews_stand_while_the_manager_is_silent(running: Running) -> None:
    running.http.get("/components")
    running.impatient()
    running.manager.silent = True
    assert running.http.get("/components/navigator").json()["spec"]["name"] == "navigator"
    assert running.http.get("/system").status_code == 200
    response = running.http.get("/architecture")
    assert response.status_code == 503
    assert int(response.headers["retry-after"]) >= 1


def test_overviews_tell_that_the_manager_has_fallen_silent_and_that_it_answers_again(running: Running) -> None:
    silence = "the adaptation manager does not answer"
    assert running.http.get("/components").json()["revision"] == 1
    running.manager.silent = True
    wait_until(lambda: silence in running.http.get("/system").json()["problems"], "the silence to be told")
    system = running.http.get("/system").json()
    assert (system["revision"], system["simulated"]) == (None, None)
    listed = running.http.get("/components").json()
    assert listed["revision"] is None
    assert next(line["desired"] for line in listed["components"] if line["name"] == "navigator") == "active"
    (host,) = running.http.get("/hosts").json()["hosts"]
    assert host["capability"] is None
    running.manager.silent = False
    wait_until(lambda: running.http.get("/system").json()["revision"] == 1, "the manager to be asked again")
    assert silence not in running.http.get("/system").json()["problems"]


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("GET", "/components/navigatr", None),
        ("GET", "/components/navigatr/qualities", None),
        ("GET", "/components/navigatr/logs", None),
        ("PATCH", "/components/navigatr/parameters", {"x": 1}),
        ("POST", "/components/navigatr/transition", {"transition": "activate"}),
        ("POST", "/components/navigatr/move", {"host": "local"}),
    ],
)
def test_a_problem_of_an_unknown_component_names_the_one_that_may_be_meant(
    shared: Running, method: str, path: str, body: Any
) -> None:
    response = shared.http.request(method, path, json=body)
    assert response.status_code == 404
    assert "did you mean 'navigator'?" in response.json()["detail"]


def test_a_field_that_is_not_there_is_told_with_the_one_that_may_be_meant(shared: Running) -> None:
    response = shared.post("/components/navigator/transition", {"transtion": "activate"})
    assert response.status_code == 422
    assert "did you mean 'transition'?" in response.json()["detail"]
