"""The missions of several robots over HTTP: each is asked by the name of its robot."""

from __future__ import annotations

from collections.abc import Iterator

import httpx
import pytest

from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec
from regraft.component.component import class_path, describe
from regraft.dashboard_api.http.roles import configures
from regraft.services.bt_executor.executor import Executor
from regraft.services.bt_executor.navigation.bt_navigator import BtNavigator
from regraft.stack.sections.components import services
from tests.gateway.conftest import client, start_gateway
from tests.gateway.http.contract import contract
from tests.gateway.parts import HostStub
from tests.gateway.reading.test_events import parse
from tests.gateway.reading.test_live_mission import start, tree
from tests.support.stepped.site import Site
from tests.support.waiting import PATIENCE, wait_until

ROBOTS = ("left", "right")
TOPICS = {f"{robot}/scan": TopicSpec(f"{robot}/scan", "regraft/LaserScan") for robot in ROBOTS}


def executor(name: str, topics: dict[str, TopicSpec] = TOPICS) -> ComponentSpec:
    """Return an executor as a stack with these topics has it."""
    spec = ComponentSpec(name, class_path(Executor), description=describe(Executor))
    return ComponentSpec(
        name,
        spec.cls,
        services=services(spec, Architecture("site", 1, False, {}, topics), {}),
        description=spec.description,
    )


@pytest.fixture
def host(site: Site) -> Iterator[HostStub]:
    """Return the host, which knows the executors of all robots."""
    names = [f"{robot}.bt_executor" for robot in ROBOTS]
    for robot, name in zip(ROBOTS, names, strict=True):
        site.start(Executor, name, scope=robot)
    stub = HostStub(site.session(), site.keys)
    stub.architecture = Architecture("site", 1, False, {name: executor(name) for name in names}, TOPICS)
    yield stub
    stub.close()


@pytest.fixture
def http(site: Site, host: HostStub) -> Iterator[httpx.Client]:
    with client(start_gateway(site)) as http:
        http.event_hooks["response"] = [contract(http).check]
        for robot in ROBOTS:
            http.params = {"robot": robot}
            start(http, tree('<Script code="n := 7"/>', robot.title()))
        http.params = {}
        yield http


def test_each_mission_is_shown_and_commanded_by_its_robot(http: httpx.Client) -> None:
    assert [http.get("/mission", params={"robot": robot}).json()["tree"] for robot in ROBOTS] == ["Left", "Right"]
    assert http.post("/mission/pause", params={"robot": "left"}).json()["state"] == "paused"
    assert http.get("/mission", params={"robot": "right.bt_executor"}).json()["state"] == "running"
    http.patch("/mission/blackboard", json={"n": 8}, params={"robot": "right"}).raise_for_status()
    entries = (http.get("/mission/blackboard", params={"robot": robot, "key": "n"}).json() for robot in ROBOTS)
    assert [found["entries"][0]["value"] for found in entries] == [7, 8]


def test_without_a_name_the_robots_are_listed(http: httpx.Client) -> None:
    for answer in (http.get("/mission"), http.post("/mission/halt"), http.patch("/mission/blackboard", json={"n": 1})):
        problem = answer.json()
        assert (answer.status_code, problem["type"]) == (422, "urn:regraft:problem:malformed")
        assert problem["violations"][0]["field"] == "robot"
        assert "left, right" in problem["detail"]
    assert http.get("/mission", params={"robot": "left"}).json()["state"] == "running"


def test_an_unknown_robot_is_not_found_and_the_nearest_name_is_told(http: httpx.Client) -> None:
    for answer in (http.get("/mission", params={"robot": "rihgt"}), http.get("/mission/events?robot=rihgt")):
        assert answer.status_code == 404
        assert "did you mean 'right'?" in answer.json()["detail"]


def test_a_robot_is_not_taken_for_removed_while_the_host_that_knows_it_is_silent(site: Site, host: HostStub) -> None:
    host.silent = True
    with client(start_gateway(site)) as http:
        http.event_hooks["response"] = [contract(http).check]
        http.params = {"robot": "left"}
        for answer in (http.get("/mission"), http.post("/mission/halt"), http.get("/mission/events")):
            assert (answer.status_code, answer.json()["type"]) == (503, "urn:regraft:problem:no-answer")
            assert int(answer.headers["retry-after"]) >= 1
        host.silent = False
        assert http.get("/mission").status_code == 200
        assert http.get("/mission", params={"robot": "third"}).status_code == 404


def test_the_mission_of_a_robot_that_was_just_added_is_found(http: httpx.Client, site: Site, host: HostStub) -> None:
    name, topics = "third.bt_executor", TOPICS | {"third/scan": TopicSpec("third/scan", "regraft/LaserScan")}
    site.start(Executor, name, scope="third")
    assert http.get("/mission", params={"robot": "left"}).status_code == 200  # what is known now is kept for a second
    components = host.architecture.components | {name: executor(name, topics)}
    host.architecture = Architecture("site", 2, False, components, topics)
    http.params = {"robot": "third"}
    start(http, tree('<Script code="n := 7"/>', "Third"))


def test_each_mission_is_followed_by_its_robot(http: httpx.Client, site: Site) -> None:
    outputs = {robot: site.runtimes[f"{robot}.bt_executor"].component.kit.outputs for robot in ROBOTS}
    url = f"{http.base_url}mission/events"
    with httpx.stream("GET", url, params={"robot": "right"}, timeout=PATIENCE) as response:
        events = parse(response.iter_lines())
        assert next(events).kind == "comment"
        wait_until(lambda: outputs["right"]["transitions"].wanted, "the right executor to be followed")
        assert not outputs["left"]["transitions"].wanted
        http.post("/mission/pause", params={"robot": "left"}).raise_for_status()
        http.post("/mission/halt", params={"robot": "right"}).raise_for_status()
        told = [next(events) for _ in range(2)]
    assert {event.data.get("subject") for event in told if event.kind.startswith("mission.")} == {"right.bt_executor"}
    assert "transitions" in {event.kind for event in told}


def test_the_tree_of_a_navigator_is_chosen_by_administrators_alone() -> None:
    description = describe(BtNavigator)
    navigator = ComponentSpec("left.bt_navigator", description=description)
    assert [configures(navigator, name) for name in ("behavior_tree", "rate")] == [True, False]


def test_the_mission_of_a_robot_among_several_is_chosen_by_administrators_alone() -> None:
    assert [configures(executor("left.bt_executor"), name) for name in ("mission", "main", "rate")] == [
        True,
        True,
        False,
    ]
