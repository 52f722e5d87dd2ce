"""Objectives over REST: every answer is checked against the API's own document."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import httpx
import pytest

from regraft.bus_schema.model.architecture import TopicSpec
from regraft.bus_schema.model.robots.planners import planner_service
from regraft.dashboard_api.routes.objectives import OBJECTIVE_EXAMPLES
from tests.gateway.conftest import client, start_gateway
from tests.gateway.http.contract import contract
from tests.metacontrol.objectives.small_metacontroller import SmallMetacontroller
from tests.planners.parts import SmallManager, spec
from tests.support.stepped.site import Site
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

VERBS = ("objective", *(f"objectives/{verb}" for verb in ("add", "list", "explain", "cancel", "report", "context")))


class Served:
    """A small robot with a metacontroller and a gateway."""

    def __init__(self, site: Site, manager: SmallManager, small: SmallMetacontroller, http: httpx.Client) -> None:
        self.site = site
        self.manager = manager
        self.small = small
        self.http = http

    def add(self, **body: Any) -> httpx.Response:
        return self.http.post("/objectives", json=body)

    def add_metacontroller(self, name: str, scope: str = "") -> SmallMetacontroller:
        """Start a further one."""
        services = {f"planners/{{name}}/{verb}": planner_service(name, verb) for verb in VERBS}
        found = self.site.start(SmallMetacontroller, name, services=services, scope=scope)
        self.manager.architecture = self.manager.architecture.with_component(
            replace(spec(SmallMetacontroller, name), services=services)
        )
        wait_until(lambda: len(self.lines()) > 1, "the further metacontroller")
        return found

    def lines(self, **query: str) -> list[dict[str, Any]]:
        """Return the metacontrollers of the list."""
        found: list[dict[str, Any]] = self.http.get("/objectives", params=query).json()["metacontrollers"]
        return found

    def names(self) -> list[str]:
        """Return the names of the objectives of the first metacontroller."""
        return [each["objective"] for each in self.lines()[0]["status"]["objectives"]]


@pytest.fixture
def served() -> Iterator[Served]:
    site = Site("memory")
    manager = site.start(SmallManager, "adaptation_manager")
    manager.architecture = manager.architecture.with_component(spec(SmallMetacontroller, "metacontrol"))
    small = site.start(SmallMetacontroller, "metacontrol")
    with client(start_gateway(site)) as http:
        http.event_hooks["response"] = [contract(http).check]
        yield Served(site, manager, small, http)
    site.close()


def test_the_first_metacontroller_can_be_asked_just_after_it_was_added(served: Served) -> None:
    added = served.manager.architecture
    without = {name: spec for name, spec in added.components.items() if name != "metacontrol"}
    served.manager.architecture = replace(added, components=without)
    wait_until(lambda: not served.lines(), "the gateway keeps an architecture without a metacontroller")
    served.manager.architecture = added
    assert served.add(skill="to_navigate", name="patrol").status_code == 201


def test_an_objective_is_created_and_shown_with_what_provides_it(served: Served) -> None:
    created = served.add(skill="to_navigate", name="patrol 1", requirements={"safety": 0.8})
    assert created.status_code == 201
    assert created.headers["Location"] == "/api/v1/objectives/patrol%201"
    shown = served.http.get("/objectives/patrol%201").json()["objectives"][0]
    assert (shown["state"], shown["realization"]) == ("IN_PROGRESS", "careful")
    assert created.json()["objectives"] == [shown]


@pytest.mark.parametrize("example", OBJECTIVE_EXAMPLES)
def test_the_examples_of_the_document_work(served: Served, example: str) -> None:
    value = OBJECTIVE_EXAMPLES[example]["value"]
    assert isinstance(value, dict)
    assert served.add(**value).status_code == 201


def test_a_list_of_objectives_is_added_whole_or_not_at_all(served: Served) -> None:
    refused = served.add(objectives=[{"skill": "to_navigate"}, {"skill": "to_detekt"}])
    assert refused.status_code == 404
    (violation,) = refused.json()["violations"]
    assert violation["field"] == "objectives.1.skill"
    assert "did you mean 'to_detect'?" in violation["problem"]
    assert served.names() == []
    added = served.add(objectives=[{"skill": "to_navigate"}, {"skill": "to_detect"}])
    assert "Location" not in added.headers
    assert served.names() == ["to_navigate", "to_detect"]


def test_an_equal_objective_of_a_present_name_is_that_one_and_another_is_refused(served: Served) -> None:
    for _ in range(2):
        assert served.add(skill="to_navigate", requirements={"safety": 0.5}).status_code == 201
    assert served.names() == ["to_navigate"]
    assert served.add(skill="to_navigate", requirements={"safety": 0.6}).status_code == 409


@pytest.mark.parametrize(
    ("body", "field", "problem"),
    [
        ({}, "skill", "is missing"),
        ({"skill": 3}, "skill", "is int, must be text"),
        ({"skill": "x" * 201}, "skill", "must be at most 200"),
        ({"skill": "a", "objectives": [{"skill": "b"}]}, "skill", "belongs to a single objective"),
        ({"objectives": []}, "objectives", "at least 1 item"),
        ({"objectives": [{"name": "b"}]}, "objectives.0.skill", "is missing"),
        ({"skill": "to_navigate", "requirements": {"safety": "high"}}, "requirements.safety", "must be a number"),
        ({"skill": "to_navigate", "operators": {"safety": ">"}}, "operators.safety", ">="),
        (
            {"skill": "to_navigate", "requirements": {"energy": 1}, "operators": {"energy": ">="}},
            "operators.energy",
            "contradicts the direction",
        ),
        ({"skill": "to_navigate", "reqirements": {}}, "reqirements", "did you mean 'requirements'?"),
        ({"skill": "to_navigate", "actor": "me"}, "actor", "X-Regraft-Actor"),
    ],
)
def test_a_body_that_does_not_fit_is_a_problem_that_names_the_field(
    served: Served, body: Any, field: str, problem: str
) -> None:
    response = served.add(**body)
    assert response.status_code == 422, response.text
    (violation,) = response.json()["violations"]
    assert violation["field"] == field
    assert problem in violation["problem"]
    assert served.names() == []


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("GET", "/objectives/patrl", None),
        ("GET", "/objectives/patrl/explanation", None),
        ("DELETE", "/objectives/patrl", None),
        ("POST", "/objectives/patrl/progress", {"text": "OK"}),
    ],
)
def test_an_unknown_objective_is_not_found_and_the_nearest_is_named(
    served: Served, method: str, path: str, body: Any
) -> None:
    served.add(skill="to_navigate", name="patrol")
    response = served.http.request(method, path, json=body)
    assert response.status_code == 404
    assert "did you mean 'patrol'?" in response.json()["detail"]


def test_a_decision_is_explained(served: Served) -> None:
    served.add(skill="to_navigate")
    found = served.http.get("/objectives/to_navigate/explanation").json()
    assert found["text"].startswith("to_navigate: fast")
    assert found["decision"] == {"design": "fast"}


def test_objectives_end_by_name_by_task_and_by_progress(served: Served) -> None:
    served.add(objectives=[{"skill": "to_navigate", "name": name, "task": "patrol"} for name in ("one", "two")])
    served.add(skill="to_navigate", name="three")
    left = served.http.delete("/objectives", params={"task": "patrol"}).json()["objectives"]
    assert [each["objective"] for each in left] == ["three"]
    near = served.http.post("/objectives/three/progress", json={"text": "near"}).json()
    assert (near["progress"], near["ended"]) == ("INPROGRESS", False)
    wrong = served.http.post("/objectives/three/progress", json={"text": "SUCESS"})
    assert (wrong.status_code, "did you mean 'SUCCESS'?" in wrong.text) == (422, True)
    done = served.http.post("/objectives/three/progress", json={"text": "SUCCESS"}).json()
    assert (done["progress"], done["ended"]) == ("SUCCESS", True)
    served.add(skill="to_navigate", name="four")
    assert served.http.delete("/objectives/four").json()["objectives"] == []
    assert served.names() == []
    assert served.http.delete("/objectives").status_code == 422


@pytest.mark.parametrize("body", [{}, {"text": "OK", "number": 1.0}])
def test_progress_is_either_a_text_or_a_number(served: Served, body: Any) -> None:
    served.add(skill="to_navigate")
    response = served.http.post("/objectives/to_navigate/progress", json=body)
    assert response.status_code == 422
    assert "either text or number" in response.json()["detail"]


def test_the_context_is_shown_and_set_at_its_metacontroller(served: Served) -> None:
    path = "/planners/metacontrol/context"
    assert served.http.get(path).json() == {"context": "Default", "contexts": ["Default", "Dark"]}
    assert served.http.put(path, json={"context": "Dark"}).json() == {"context": "Dark", "before": "Default"}
    assert served.http.get(path).json()["context"] == "Dark"
    unknown = served.http.put(path, json={"context": "Darc"})
    assert (unknown.status_code, "did you mean 'Dark'?" in unknown.text) == (404, True)
    other = served.http.get("/planners/metacontrl/context")
    assert (other.status_code, "did you mean 'metacontrol'?" in other.text) == (404, True)


def test_a_name_that_a_path_uses_is_a_name_like_any_other(served: Served) -> None:
    for name in ("context", "explanation", "progress"):
        assert served.add(skill="to_navigate", name=name).status_code == 201
        assert served.http.get(f"/objectives/{name}").json()["objectives"][0]["objective"] == name


def test_several_metacontrollers_are_listed_and_one_is_meant_by_name(served: Served) -> None:
    other = served.add_metacontroller("second")
    unclear = served.add(skill="to_navigate")
    assert unclear.status_code == 422
    assert "several metacontrollers: metacontrol, second: name one of them" in unclear.json()["detail"]
    assert served.http.post("/objectives?planner=second", json={"skill": "to_navigate"}).status_code == 201
    assert (list(other.known), list(served.small.known)) == (["to_navigate"], [])
    assert [line["planner"] for line in served.lines()] == ["metacontrol", "second"]
    assert [line["component"] for line in served.lines(planner="second")] == ["second"]
    unknown = served.http.get("/objectives", params={"planner": "secnd"})
    assert (unknown.status_code, "did you mean 'second'?" in unknown.text) == (404, True)
    assert served.http.get("/objectives", params={"robot": "left"}).status_code == 404


@pytest.mark.parametrize("query", ["?planner=left.metacontrol", "?robot=left", "?planner=left.metacontrol&robot=left"])
def test_the_location_of_an_objective_names_the_metacontroller_that_was_meant(served: Served, query: str) -> None:
    of_left = TopicSpec("left/velocity", "regraft/Twist")
    served.manager.architecture = served.manager.architecture.with_topics([of_left])
    served.add_metacontroller("left.metacontrol", "left")
    created = served.http.post(f"/objectives{query}", json={"skill": "to_navigate", "name": "patrol 1"})
    location = created.headers["Location"]
    assert location == f"/api/v1/objectives/patrol%201{query}"
    shown = served.http.get(location.removeprefix("/api/v1"))
    assert (shown.status_code, shown.json()["objectives"][0]["objective"]) == (200, "patrol 1")
    assert served.http.delete(location.removeprefix("/api/v1")).status_code == 200


def test_the_metacontroller_of_a_robot_has_a_scope(served: Served) -> None:
    other = served.add_metacontroller("left.metacontrol", "left")
    created = served.http.post("/objectives?planner=left.metacontrol", json={"skill": "to_navigate"})
    assert created.status_code == 201
    assert list(other.known) == ["to_navigate"]


def test_a_system_without_metacontrollers_has_an_empty_list_and_takes_no_objectives(served: Served) -> None:
    components = dict(served.manager.architecture.components)
    del components["metacontrol"]
    served.manager.architecture = replace(served.manager.architecture, components=components)
    wait_until(lambda: not served.lines(), "a list without metacontrollers")
    response = served.add(skill="to_navigate")
    assert response.status_code == 503
    assert "the system has no metacontroller" in response.json()["detail"]


def test_a_metacontroller_that_is_gone_is_unavailable_and_named_in_the_list(served: Served) -> None:
    served.site.set_parameters("gateway", {"answer_within": 0.5, "adaptation_within": 0.5})
    served.site.stop("metacontrol")
    wait_until(lambda: not served.site.bus.present(served.site.keys.alive("metacontrol", "*"), 1.0))
    response = served.add(skill="to_navigate")
    assert response.status_code == 503
    assert "may still happen: see GET /objectives" in response.json()["detail"]
    (line,) = served.lines()
    assert line["status"] is None
    assert "planners/metacontrol/objectives/list" in line["problem"]


def test_objectives_are_given_in_the_name_of_the_caller_and_without_waiting_where_that_is_preferred(
    served: Served,
) -> None:
    headers = {"X-Regraft-Actor": "desk", "Prefer": "respond-async"}
    assert served.http.post("/objectives", json={"skill": "to_navigate"}, headers=headers).status_code == 201
    (request,) = served.small.requests
    assert (request.actor.endswith(": desk"), request.wait) == (True, False)
