"""The mission over HTTP, with the executor itself behind it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import httpx
import pytest

from regraft.services.bt_executor.executor import Executor
from tests.gateway.conftest import client, start_gateway
from tests.gateway.http.contract import contract
from tests.gateway.reading.test_events import Told, parse
from tests.support.stepped.site import Site
from tests.support.waiting import wait_until

WAIT = '<Sleep name="wait" msec="1000000"/>'


def tree(body: str, name: str = "Main") -> str:
    """Return the XML of a tree: a sequence of these nodes, then one that waits."""
    nodes = f"<Sequence>{body}{WAIT}</Sequence>"
    return f'<root BTCPP_format="4"><BehaviorTree ID="{name}">{nodes}</BehaviorTree></root>'


@pytest.fixture
def http(site: Site) -> Iterator[httpx.Client]:
    site.start(Executor, "bt_executor")
    url = start_gateway(site)
    with client(url) as http:
        http.event_hooks["response"] = [contract(http).check]
        yield http


def start(http: httpx.Client, xml: str) -> None:
    """Load a tree and start it."""
    http.post("/mission/load", json={"tree": xml}).raise_for_status()
    http.post("/mission/start").raise_for_status()
    wait_until(lambda: http.get("/mission").json()["running"] == ["wait"], "the tree to wait")


@contextmanager
def following(http: httpx.Client, last: str = "") -> Iterator[Iterator[Told]]:
    """Follow the mission, beginning when the stream is open."""
    headers = {"Last-Event-ID": last} if last else {}
    with (
        client(str(http.base_url)) as mine,
        mine.stream("GET", "/mission/events", headers=headers) as response,
    ):
        assert response.status_code == 200
        events = parse(response.iter_lines())
        assert next(events).kind == "comment"
        yield events


def test_another_tree_takes_over_with_the_blackboard(http: httpx.Client) -> None:
    start(http, tree('<Script code="n := 7"/>', "Old"))
    old = http.get("/mission").json()
    swapped = http.post("/mission/swap", json={"tree": tree('<Script code="m := n + 1"/>', "New")})
    assert swapped.status_code == 200
    new = swapped.json()
    assert (new["tree"], new["state"], new["blackboard"]["m"]) == ("New", "running", 8)
    assert new["structure"] != old["structure"]


def test_counts_are_shown_once_they_are_asked_for(http: httpx.Client, site: Site) -> None:
    assert http.get("/mission/counts").status_code == 404
    start(http, tree('<Script code="n := 7"/>', "Old"))
    refused = http.get("/mission/counts")
    assert (refused.status_code, "parameter 'counts'" in refused.json()["detail"]) == (409, True)
    assert http.delete("/mission/counts").status_code == 409


def test_a_mission_stops_at_breakpoints_and_goes_on_with_a_forced_result(http: httpx.Client) -> None:
    assert http.get("/mission/breakpoints").status_code == 404
    http.post("/mission/load", json={"tree": tree('<Script name="first" code="n := 7"/>', "Debugged")})
    assert http.post("/mission/breakpoints", json={"node": "frst"}).status_code == 404
    assert http.post("/mission/breakpoints", json={"position": "after"}).status_code == 422
    assert http.post("/mission/breakpoints", json={"node": "first", "result": "running"}).status_code == 422
    (found,) = http.post("/mission/breakpoints", json={"node": "first", "once": True}).json()["breakpoints"]
    assert (found["node"], found["position"], found["once"]) == ("first", "before", True)
    assert http.post("/mission/continue").status_code == 409
    assert http.post("/mission/next").json()["stop"]["position"] == "before"
    assert http.post("/mission/continue").json()["stop"]["node"] == "first"
    assert http.get("/mission").json()["stop"]["node"] == "first"
    assert http.post("/mission/continue", json={"result": "failure"}).json()["state"] == "failed"
    assert http.get("/mission/breakpoints").json()["breakpoints"] == []
    http.post("/mission/breakpoints", json={"node": "first", "position": "after"})
    assert http.delete("/mission/breakpoints", params={"node": "first"}).status_code == 404
    left = http.delete("/mission/breakpoints", params={"node": "first", "position": "after"})
    assert left.json()["breakpoints"] == []
    assert http.delete("/mission/breakpoints").status_code == 200


def test_a_bad_tree_does_not_take_over(http: httpx.Client) -> None:
    assert http.post("/mission/swap", json={"tree": tree("")}).status_code == 409
    start(http, tree("", "Old"))
    refused = http.post("/mission/swap", json={"tree": tree("<Unknown/>", "New")})
    assert (refused.status_code, refused.json()["type"]) == (422, "urn:regraft:problem:invalid")
    assert "unknown node type 'Unknown'" in refused.json()["detail"]
    assert http.post("/mission/swap", json={}).status_code == 422
    assert http.post("/mission/check", json={"tree": tree("<AlwaysSuccess/>", "Fine")}).json()["tree"] == "Old"
    refused = http.post("/mission/check", json={"tree": tree("<Unknown/>", "New")})
    assert refused.status_code == 422
    assert "Unknown" in refused.json()["detail"]
    assert http.get("/mission").json()["tree"] == "Old"


def test_entries_are_read_and_written(http: httpx.Client) -> None:
    start(http, tree('<Script code="n := 7"/>'))
    (entry,) = http.get("/mission/blackboard", params={"key": "n"}).json()["entries"]
    assert (entry["key"], entry["value"], entry["type"], entry["sequence"]) == ("n", 7, "int", 1)
    assert entry["age"] >= 0.0
    written = http.patch("/mission/blackboard", json={"n": 8, "label": "box"})
    assert [entry["value"] for entry in written.json()["entries"]] == [8, "box"]
    assert http.get("/mission").json()["blackboard"]["n"] == 8
    assert http.patch("/mission/blackboard", json={"label": None}).json()["entries"] == []
    assert "label" not in http.get("/mission").json()["blackboard"]


def test_what_does_not_fit_is_invalid_and_what_is_not_there_is_not_found(http: httpx.Client) -> None:
    assert http.get("/mission/blackboard").status_code == 404
    start(http, tree('<Script code="n := 7"/>'))
    refused = http.patch("/mission/blackboard", json={"m": 1, "n": "no number"})
    assert (refused.status_code, refused.json()["type"]) == (422, "urn:regraft:problem:invalid")
    assert "'no number'" in refused.json()["detail"]
    assert http.get("/mission/blackboard", params={"key": "m"}).status_code == 404
    assert http.get("/mission/blackboard", params={"board": "inner"}).status_code == 404
    assert http.patch("/mission/blackboard", json={"n": 1}, params={"board": "inner"}).status_code == 404
    assert http.patch("/mission/blackboard", json=[1]).status_code == 422


def test_the_mission_can_be_followed(http: httpx.Client, site: Site) -> None:
    executor = site.runtimes["bt_executor"].component
    start(http, tree("", "Old"))
    with following(http) as events:
        wait_until(lambda: executor.kit.outputs["transitions"].wanted, "the executor to be followed")
        http.patch("/mission/blackboard", json={"n": 1}).raise_for_status()
        new = http.post("/mission/swap", json={"tree": tree("<AlwaysSuccess/>", "New")}).json()["structure"]
        told = [next(events) for _ in range(4)]
    kinds = [event.kind for event in told]
    assert sorted(kinds) == ["mission.swapped", "mission.written", "transitions", "transitions"]
    batches = [event.data for event in told if event.kind == "transitions"]
    assert [batch["structure"] == new for batch in batches] == [False, True]
    assert [change["after"] for change in batches[1]["changes"]] == ["running", "success", "running"]
    wait_until(lambda: not executor.kit.outputs["transitions"].wanted, "nobody to follow any more")


def test_who_comes_back_is_told_that_something_was_missed(http: httpx.Client) -> None:
    start(http, tree(""))
    with following(http) as events:
        http.patch("/mission/blackboard", json={"n": 1}).raise_for_status()
        last = next(events)
        with following(http, last.id) as again:
            http.patch("/mission/blackboard", json={"n": 2}).raise_for_status()
            assert next(again).data["text"] == "n = 2"
    with following(http, "0badcafe-1") as events:
        assert (next(events).kind) == "gap"
