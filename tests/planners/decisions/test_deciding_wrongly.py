"""Decisions that cannot be taken are refused, and planners live on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from regraft import CallFailed
from regraft.adaptation_manager.planners.forecast.forecast_planner import ForecastPlanner
from regraft.bus_schema.model.adaptation import Outcome
from regraft.component.parameters import ParameterError
from tests.planners.decisions.deciding import (
    PACE,
    PLANNERS,
    bench,
    both,
)
from tests.planners.parts import SPEEDS


@both
@pytest.mark.parametrize(
    ("inputs", "told"),
    [
        ({"decision": "pacee"}, "inputs.decision: there is no decision 'pacee'; did you mean 'pace'?"),
        ({"options": [SPEEDS]}, "inputs.options: is given next to 'decision', which has its own"),
        ({"strategy": "ucb77"}, "inputs.strategy: there is no strategy 'ucb77'"),
        ({"sort": 1}, "sort"),
    ],
)
def test_inputs_that_do_not_fit_a_decision_are_refused_by_name(
    tmp_path: Path, name: str, inputs: dict[str, Any], told: str
) -> None:
    with bench(tmp_path, name) as on:
        with pytest.raises(CallFailed) as failure:
            on.propose(**inputs)
        assert told in failure.value.why
        assert on.manager.requests == []


@both
def test_a_decision_about_what_is_not_there_is_refused_and_nothing_is_done(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE.replace("component: navigator", "component: navigatr")) as on:
        with pytest.raises(CallFailed, match="choice pace: there is no component 'navigatr'; did you mean 'navigator'"):
            on.propose()
        assert on.manager.requests == []


def test_the_forecast_refuses_a_utility_that_it_cannot_express(tmp_path: Path) -> None:
    text = PACE.replace('speed: {measured: "0.5", estimated: navigator.speed}', 'speed: {measured: "0.5"}')
    told = r"pace: qualities\.speed is only measured, so it cannot be expected"
    with bench(tmp_path, "forecast", text) as on, pytest.raises(CallFailed, match=told):
        on.propose(context={"darkness": 0.2})


def test_what_the_forecast_cannot_search_in_its_way_is_refused_with_another(tmp_path: Path) -> None:
    told = r"inputs\.knobs: there is no solver 'cpsat'; did you mean 'cp_sat'"
    with bench(tmp_path, "forecast") as on, pytest.raises(CallFailed, match=told):
        on.propose(knobs={"solver": "cpsat"})


@both
def test_a_decision_that_is_rolled_back_is_told(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name) as on:
        on.dark(0.95)
        on.manager.fates = [Outcome.ROLLED_BACK]
        proposal = on.propose()
        assert proposal.choice["outcome"] == "rolled_back"
        assert proposal.ticket == ""


@both
def test_a_file_with_mistakes_keeps_the_planner_from_starting_by_line_and_field(tmp_path: Path, name: str) -> None:
    (tmp_path / "pace.yaml").write_text(PACE.replace("topic: light", "topik: light"))
    with pytest.raises(ParameterError, match=r"pace\.yaml:2: context\.darkness"):
        list(PLANNERS[name].ports_for({"decisions": str(tmp_path)}))


@pytest.mark.parametrize(
    ("file", "told"),
    [("pa-ce.yaml", "'pa-ce' must be letters, digits and '_'"), ("pace.txt", "holds no decision: must have at least")],
)
def test_a_folder_without_decisions_or_with_a_name_that_cannot_be_is_refused(
    tmp_path: Path, file: str, told: str
) -> None:
    (tmp_path / file).write_text(PACE)
    with pytest.raises(ParameterError, match=told):
        list(ForecastPlanner.ports_for({"decisions": str(tmp_path)}))


@both
def test_an_architecture_that_changed_meanwhile_is_decided_on_anew(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name) as on:
        on.dark(0.95)
        on.manager.fates = ["overtaken"]
        on.manager.architecture = replace(on.manager.architecture, revision=7)
        assert on.propose().choice["outcome"] == "applied"
        assert len(on.manager.requests) == 2
