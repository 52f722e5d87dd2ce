from __future__ import annotations

from tests.gateway.conftest import Running
from tests.waiting import wait_until

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
    assert running.post("/mission/load", {"tree": "not XML"}).status_code == 409


def test_a_malformed_command_is_told_by_field(running: Running) -> None:
    assert running.post("/mission/load", {}).json()["violations"][0]["field"] == "tree"
    assert running.post("/mission/load", {"tree": 1}).json()["violations"][0]["field"] == "tree"
    assert running.post("/mission/load", {"tree": TREE, "root": "Main"}).status_code == 422
    assert running.post("/mission/start", {"tree": TREE}).status_code == 422


def test_without_an_executor_the_mission_is_unavailable(running: Running) -> None:
    running.impatient()
    running.site.stop("bt_executor")
    wait_until(lambda: not running.site.bus.present(running.site.keys.alive("bt_executor", "*"), 1.0))
    assert running.http.get("/mission").status_code == 503
    assert running.http.post("/mission/halt").status_code == 503
