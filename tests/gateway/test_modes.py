"""``GET /modes``: targets, actual modes and states of all parts, from the real manager."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import httpx
import pytest

from regraft.adaptation_manager.planners.modes.mode_planner import ModePlanner
from regraft.bus_schema.model.adaptation import EnterMode, SetParameters
from regraft.bus_schema.model.architecture import Architecture
from tests.adaptation.parts import Fragile, Talker
from tests.adaptation.system import System, small_architecture, spec_of
from tests.gateway.real_manager import served

TALKER = "rescuer.talker"


def _rate(component: str, rate: float) -> dict[str, Any]:
    return {"change": "set_parameters", "component": component, "parameters": {"rate": rate}}


MODES = {
    "asleep": [{"change": "transition", "component": "fragile", "transition": "deactivate"}],
    "awake": [{"change": "transition", "component": "fragile", "transition": "activate"}],
    "talker.slow": [_rate("talker", 10.0)],
    "rescuer/night": [_rate(TALKER, 10.0)],
    "rescuer/talker.fast": [_rate(TALKER, 40.0)],
    "rescuer/talker.broken": [_rate(TALKER, -1.0)],
    "rescuer/voice.LOW": [_rate(TALKER, 10.0)],
}


def _architecture() -> Architecture:
    small = small_architecture()
    topics = {**small.topics, "rescuer/numbers": replace(small.topics["numbers"], name="rescuer/numbers")}
    components = {
        **small.components,
        TALKER: spec_of(TALKER, Talker, connections={"numbers": "rescuer/numbers"}),
        "rescuer.fragile": spec_of("rescuer.fragile", Fragile, connections={"heard": "rescuer/numbers"}),
        "mode_planner": spec_of("mode_planner", ModePlanner),
    }
    return replace(small, components=components, topics=topics, modes=MODES)


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[System, httpx.Client]]:
    with served(_architecture(), tmp_path_factory.mktemp("modes")) as both:
        yield both


def _parts(http: httpx.Client, **query: Any) -> dict[str, dict[str, Any]]:
    answer = http.get("/modes", params=query)
    assert answer.status_code == 200, answer.text
    return {part["part"]: part for part in answer.json()["parts"]}


def test_the_system_comes_first_and_every_part_has_target_actual_mode_and_state(both: Any) -> None:
    system, http = both
    system.adapt(EnterMode("asleep"))
    system.adapt(EnterMode("rescuer/talker.fast"))
    system.adapt(SetParameters("talker", {"rate": 10.0}))
    body = http.get("/modes").json()
    assert body["decider"] == "mode_planner"
    assert body["revision"] == http.get("/architecture").json()["revision"]
    first, *others = body["parts"]
    assert first == {
        "part": "",
        "kind": "system",
        "target": "asleep",
        "actual": "asleep",
        "as_asked": True,
        "state": "active",
        "target_state": "",
        "failure": "",
        "modes": [
            {"mode": "asleep", "fits": True, "reachable": None, "problem": ""},
            {"mode": "awake", "fits": False, "reachable": None, "problem": ""},
        ],
    }
    assert [part["part"] for part in others] == sorted(part["part"] for part in others)
    parts = _parts(http)
    assert (parts[TALKER]["target"], parts[TALKER]["actual"]) == ("rescuer/talker.fast", "rescuer/talker.fast")
    assert (parts["talker"]["target"], parts["talker"]["actual"]) == ("", "talker.slow")
    assert (parts["fragile"]["state"], parts["fragile"]["target_state"]) == ("inactive", "inactive")
    assert [parts[name]["kind"] for name in ("rescuer", "rescuer.voice", TALKER)] == ["robot", "subsystem", "component"]
    system.adapt(SetParameters(TALKER, {"rate": 41.0}))
    talker = _parts(http)[TALKER]
    assert (talker["target"], talker["actual"], talker["as_asked"]) == ("rescuer/talker.fast", "", False)


def test_what_could_be_entered_is_checked_where_that_is_asked_with_the_reasons(both: Any) -> None:
    _, http = both
    parts = _parts(http, reachable="true")
    assert all(mode["reachable"] and not mode["problem"] for mode in parts[""]["modes"])
    fast, broken = parts[TALKER]["modes"]
    assert (fast["reachable"], fast["problem"]) == (True, "")
    assert not broken["reachable"]
    assert f"{TALKER}.parameters.rate: -1.0: must be at least 0.0" in broken["problem"]
    assert http.get("/modes", params={"reachable": "perhaps"}).status_code == 422


def test_one_robot_has_itself_its_components_and_its_subsystems(both: Any) -> None:
    _, http = both
    assert list(_parts(http, robot="rescuer")) == ["rescuer", "rescuer.fragile", TALKER, "rescuer.voice"]


def test_a_robot_that_is_not_there_is_a_problem_with_the_nearest(both: Any) -> None:
    _, http = both
    answer = http.get("/modes", params={"robot": "rescuar"})
    assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")
    problem = answer.json()
    assert (problem["type"], problem["status"]) == ("urn:regraft:problem:not-found", 404)
    assert "no robot 'rescuar'; did you mean 'rescuer'?" in problem["detail"]


def test_it_works_while_the_mode_planner_is_dead(both: Any) -> None:
    system, http = both
    system.running["mode_planner"].kill()
    system.host.ended("mode_planner")
    parts = _parts(http)
    assert (parts["mode_planner"]["state"], parts[""]["state"]) == ("unknown", "active")
    assert "mode_planner" in parts["mode_planner"]["failure"]
    assert http.get("/modes").json()["decider"] == "mode_planner"


def test_it_is_unavailable_while_the_manager_is_away_and_back_with_it(both: Any) -> None:
    system, http = both
    system.running["adaptation_manager"].kill()
    answer = http.get("/modes")
    assert (answer.status_code, answer.headers["content-type"]) == (503, "application/problem+json")
    assert answer.json()["type"].rpartition(":")[2] in ("unavailable", "no-answer")
    assert int(answer.headers["retry-after"]) >= 1
    system.start_manager("adaptation_manager")
    assert _parts(http)[""]["target"] == "asleep"


def test_an_answer_names_the_components_that_were_not_reached_and_why(both: Any) -> None:
    system, http = both
    system.running["second"].kill()
    system.host.ended("second")
    change = {"change": "transition", "component": "second", "transition": "deactivate"}
    answer = http.post("/adaptations", json={"reason": "it is broken", "changes": [change]})
    assert answer.json()["outcome"] == "applied", answer.text
    (unreached,) = answer.json()["unreached"]
    assert (unreached["component"], unreached["code"], unreached["host"]) == ("second", "not_running", "local")
    assert http.get(f"/adaptations/{answer.json()['id']}").json()["unreached"] == [unreached]
