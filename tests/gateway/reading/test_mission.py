from __future__ import annotations

from regraft.bus_schema.messages.protocol.control import ParameterValues
from tests.gateway.conftest import Running
from tests.gateway.parts import ScriptedExecutor, spec
from tests.support.waiting import wait_until

TREE = '<root BTCPP_format="4"><BehaviorTree ID="Main"><AlwaysSuccess/></BehaviorTree></root>'


def test_a_mission_is_loaded_and_started(running: Running) -> None:
    assert running.http.get("/mission").json()["state"] == "empty"
    loaded = running.post("/mission/load", {"tree": TREE})
    assert (loaded.status_code, loaded.json()["state"]) == (200, "loaded")
    assert running.http.post("/mission/start").json()["state"] == "running"
    assert running.http.get("/mission").json()["tree"] == TREE


def test_a_command_that_does_not_fit_the_state_is_a_conflict(running: Running) -> None:
    for command in ("start", "pause", "step", "halt"):
        response = running.http.post(f"/mission/{command}")
        assert response.status_code == 409
        assert "not possible while empty" in response.json()["detail"]
    refused = running.post("/mission/load", {"tree": "not XML"})
    assert (refused.status_code, refused.json()["type"]) == (422, "urn:regraft:problem:invalid")


def test_a_malformed_command_is_told_by_field(running: Running) -> None:
    assert running.post("/mission/load", {}).json()["violations"][0]["field"] == "tree"
    assert running.post("/mission/load", {"tree": 1}).json()["violations"][0]["field"] == "tree"
    assert running.post("/mission/load", {"tree": TREE, "root": "Main"}).status_code == 422
    assert running.post("/mission/start", {"tree": TREE}).status_code == 422


ROUTES = (
    ("GET", "/mission", None),
    ("GET", "/mission/blackboard", None),
    ("PATCH", "/mission/blackboard", {"rounds": 1}),
    ("POST", "/mission/load", {"tree": TREE}),
    ("POST", "/mission/start", None),
    ("POST", "/mission/halt", None),
)


def _without_executor(running: Running) -> None:
    running.site.stop("bt_executor")
    wait_until(lambda: not running.site.bus.present(running.site.keys.alive("bt_executor", "*"), 1.0))
    # It takes its token off the bus before its services.
    wait_until(lambda: not any(running.site.client.reaches(f"mission/{name}") for name in ("status", "command")))


def test_an_executor_that_is_gone_but_may_come_back_is_waited_for(running: Running) -> None:
    running.impatient()
    boards = {name: f"mission/{name}" for name in ("blackboard", "write")}
    executor = spec(ScriptedExecutor, "bt_executor", services=boards)
    running.host.architecture = running.host.architecture.with_component(executor)
    _without_executor(running)
    for method, path, body in ROUTES:
        response = running.http.request(method, path, json=body)
        assert response.status_code == 503
        assert "waited 0.5 s" in response.json()["detail"]


def test_without_an_executor_the_mission_is_unavailable_at_once(running: Running) -> None:
    values = ParameterValues({"answer_within": 60.0})
    running.site.client.control("gateway", "parameters", values)
    _without_executor(running)
    for method, path, body in ROUTES:
        response = running.http.request(method, path, json=body)
        assert response.status_code == 503
        assert response.json()["detail"].startswith("no component of the system offers the service 'mission/")
