"""Planners over REST: every answer is checked against the API's own document."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import httpx
import pytest

from regraft.adaptation_manager.planners.bandits.bandit_planner import BanditPlanner
from regraft.bus_schema.model.adaptation import Outcome
from regraft.bus_schema.model.robots.planners import planner_service
from regraft.dashboard_api.http.authentication import user_name
from regraft.dashboard_api.routes.planners import PROPOSAL_EXAMPLE
from tests.gateway.conftest import client, start_gateway
from tests.gateway.http.contract import contract
from tests.planners.parts import SPEEDS, SmallManager, spec
from tests.support.stepped.site import Site
from tests.support.waiting import wait_until

PROPOSE = "/planners/bandits/propose"


class Served:
    """A small robot with a planner and a gateway."""

    def __init__(self, site: Site, manager: SmallManager, http: httpx.Client) -> None:
        self.site = site
        self.manager = manager
        self.http = http

    def propose(self, path: str = PROPOSE, *, headers: Any = None, **body: Any) -> httpx.Response:
        usual = {"task": "drive", "inputs": {"strategy": "ucb1", "options": [SPEEDS]}}
        return self.http.post(path, json={**usual, **body}, headers=headers)


@pytest.fixture
def served() -> Iterator[Served]:
    site = Site("memory")
    manager = site.start(SmallManager, "adaptation_manager")
    robot = manager.architecture
    manager.architecture = replace(robot, components={**robot.components, "bandits": spec(BanditPlanner, "bandits")})
    site.start(BanditPlanner, "bandits")
    with client(start_gateway(site)) as http:
        http.event_hooks["response"] = [contract(http).check]
        yield Served(site, manager, http)
    site.close()


def test_planners_are_listed_with_their_strategies_and_knobs(served: Served) -> None:
    (line,) = served.http.get("/planners").json()["planners"]
    assert (line["planner"], line["component"], line["problem"]) == ("bandits", "bandits", "")
    strategies = {strategy["name"]: strategy["knobs"] for strategy in line["description"]["strategies"]}
    assert strategies["epsilon_greedy"]["properties"]["epsilon"]["maximum"] == 1.0
    assert line["description"]["inputs"]["required"] == ["strategy", "options"]


def test_a_proposal_is_carried_out_in_the_name_of_who_asked(served: Served) -> None:
    response = served.propose(reason="because", headers={"X-Regraft-Actor": "safety desk"})
    assert response.status_code == 200
    answer = response.json()
    assert answer["ticket"]
    assert answer["report"]["outcome"] == "applied"
    assert answer["changes"] == [
        {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": 0.1}}
    ]
    assert served.manager.requests[0].actor == f"{user_name(os.geteuid())}: safety desk, by bandits"


def test_a_dry_proposal_touches_nothing(served: Served) -> None:
    answer = served.propose(apply=False).json()
    assert (answer["choice"]["outcome"], answer["ticket"], answer["report"]) == ("dry", "", None)
    assert served.manager.requests == []


def test_the_example_of_the_document_works(served: Served) -> None:
    assert served.http.post(PROPOSE, json=PROPOSAL_EXAMPLE).json()["choice"]["outcome"] == "applied"


def test_a_rejected_adaptation_is_told_by_the_proposal(served: Served) -> None:
    served.manager.fates = [Outcome.REJECTED]
    answer = served.propose().json()
    assert (answer["choice"]["outcome"], answer["ticket"]) == ("rejected", "")


@pytest.mark.parametrize(
    ("body", "field", "said"),
    [
        ({"task": ""}, "task", "is empty"),
        ({"task": 3}, "task", "is int, must be text"),
        ({"inputs": {"strategy": "ucb", "options": [SPEEDS]}}, "inputs.strategy", "there is no strategy 'ucb'"),
        ({"inputs": {"strategy": "ucb1", "options": []}}, "inputs.options", "are 0, must be 1 to 64"),
        ({"inputs": {}}, "inputs.strategy", "is missing"),
        ({"actor": "me"}, "actor", "X-Regraft-Actor"),
        ({"surprise": 1}, "surprise", "there is no such field"),
    ],
)
def test_what_does_not_fit_is_a_problem_that_names_the_field(served: Served, body: Any, field: str, said: str) -> None:
    response = served.propose(**body)
    assert response.status_code == 422
    (violation,) = response.json()["violations"]
    assert violation["field"] == field
    assert said in violation["problem"]


def test_an_unknown_planner_is_not_found(served: Served) -> None:
    response = served.propose("/planners/bandit/propose")
    assert response.status_code == 404
    assert "did you mean 'bandits'?" in response.json()["detail"]


def test_a_planner_that_was_just_added_can_be_asked(served: Served) -> None:
    services = {f"planners/{{name}}/{verb}": planner_service("second", verb) for verb in ("propose", "describe")}
    served.site.start(BanditPlanner, "second", services=services)
    assert len(served.http.get("/planners").json()["planners"]) == 1  # the gateway keeps this for a second
    added = replace(spec(BanditPlanner, "second"), services=services)
    served.manager.architecture = served.manager.architecture.with_component(added)
    assert served.propose("/planners/second/propose").status_code == 200


def test_a_planner_that_is_gone_is_unavailable_and_said_in_the_list(served: Served) -> None:
    served.site.set_parameters("gateway", {"answer_within": 0.5, "adaptation_within": 0.5})
    served.site.stop("bandits")
    wait_until(lambda: not served.site.bus.present(served.site.keys.alive("bandits", "*"), 1.0))
    response = served.propose()
    assert response.status_code == 503
    assert "may still happen" in response.json()["detail"]
    (line,) = served.http.get("/planners").json()["planners"]
    assert line["description"] is None
    assert "planners/bandits/describe" in line["problem"]


def test_a_manager_that_cannot_be_asked_makes_proposals_unavailable(served: Served) -> None:
    assert served.http.get("/planners").status_code == 200
    served.manager.fates = ["blind"]
    response = served.propose()
    assert response.status_code == 503
    assert "the journal cannot be read" in response.json()["detail"]


def test_two_planners_of_one_class_are_listed_and_asked_apart(served: Served) -> None:
    for name, scope in (("cautious", ""), ("left.bandits", "left")):
        services = {f"planners/{{name}}/{verb}": planner_service(name, verb) for verb in ("propose", "describe")}
        served.site.start(BanditPlanner, name, services=services, scope=scope)
        served.manager.architecture = served.manager.architecture.with_component(
            replace(spec(BanditPlanner, name), services=services)
        )

    def described() -> list[dict[str, Any]]:
        lines: list[dict[str, Any]] = served.http.get("/planners").json()["planners"]
        return [line for line in lines if line["description"]]

    wait_until(lambda: len(described()) == 3, "three planners to answer")
    lines = described()
    expected = ["bandits", "cautious", "left.bandits"]
    assert [line["planner"] for line in lines] == [line["component"] for line in lines] == expected
    assert [line["description"]["planner"] for line in lines] == expected
    for name in reversed(expected):
        answer = served.propose(f"/planners/{name}/propose", reason="because").json()
        assert answer["choice"]["why"].startswith("not tried yet"), "each learns for itself"
    assert served.manager.requests[0].actor.endswith("by left.bandits")
