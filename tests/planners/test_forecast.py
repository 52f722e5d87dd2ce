"""The forecast takes what the components' classes expect to be worth most, and says when it cannot tell."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from regraft import CallFailed, Component, Output, Parameter, Quality
from regraft.adaptation_manager.planners.forecast.forecast_planner import ForecastPlanner
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.planning import PlannerDescription, PlannerQuery, Proposal, ProposalRequest
from regraft.bus_schema.model.adaptation import Outcome, SetParameters
from regraft.client import as_json
from regraft.testing import Rig
from tests.planners.parts import SPEEDS, SmallManager, spec

UTILITY = "navigator.speed * navigator.safety"
NEAR = {"near": "1.0 if nearest < 0.5 else 0.0"}


class Careful(Component):
    """Is safe where nothing is near, or slowly."""

    velocity = Output(Twist)
    max_velocity = Parameter(0.26, minimum=0.0, maximum=0.26, unit="m/s")

    speed = Quality(unit="m/s", better="higher", measured=False)
    safety = Quality(better="higher", minimum=0.0, maximum=1.0, measured=False)

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        speed = float(parameters["max_velocity"])
        return {"speed": speed, "safety": 1.0 if speed < 0.18 else 1.0 - float(context["near"])}


class Bench:
    def __init__(self, rig: Rig, manager: SmallManager) -> None:
        self.rig = rig
        self.manager = manager

    def propose(
        self, context: dict[str, Any], options: Any = (SPEEDS,), apply: bool = True, strategy: str = "expected_utility",
        **knobs: Any,
    ) -> Proposal:  # fmt: skip
        given = {"strategy": strategy, "options": list(options), "knobs": {"utility": UTILITY, "assume": NEAR, **knobs}}
        request = ProposalRequest("drive", "pace", "tree", apply, given, context)
        return self.rig.call("planners/forecast/propose", request, Proposal, timeout=60.0)


@contextmanager
def bench() -> Iterator[Bench]:
    with Rig() as rig:
        manager = rig.add(SmallManager, "adaptation_manager")
        manager.architecture = manager.architecture.with_component(spec(Careful, "navigator"))
        rig.add(ForecastPlanner, "forecast")
        yield Bench(rig, manager)


def test_the_option_that_is_expected_to_be_worth_most_is_applied_and_the_journal_says_why() -> None:
    with bench() as on:
        proposal = on.propose({"nearest": 0.3})
        assert proposal.changes == (SetParameters("navigator", {"max_velocity": 0.1}),)
        assert proposal.choice["outcome"] == "applied"
        (request,) = on.manager.requests
        assert request.actor == "tree, by forecast"
        assert request.reason == "pace; expected 0.1 (0.1: 0.1, 0.18: 0, 0.26: 0)"
        back = on.propose({"nearest": 2.0})
        assert back.changes == (SetParameters("navigator", {"max_velocity": 0.26}),)


def test_the_architecture_is_read_again_only_after_it_has_changed() -> None:
    with bench() as on:
        for _ in range(3):
            on.propose({"nearest": 2.0})
        assert on.manager.shown == 1
        on.propose({"nearest": 0.3})
        on.propose({"nearest": 0.3})
        assert on.manager.shown == 2


def test_what_stands_stays_if_nothing_is_better_by_the_margin() -> None:
    with bench() as on:
        assert on.propose({"nearest": 2.0}).choice["outcome"] == "unchanged"
        assert on.propose({"nearest": 0.3}, margin=0.2).choice["outcome"] == "unchanged"
        assert on.manager.requests == []


def test_a_dry_run_says_what_would_be_chosen_and_touches_nothing() -> None:
    with bench() as on:
        proposal = on.propose({"nearest": 0.3}, apply=False)
        assert proposal.choice["outcome"] == "dry"
        assert proposal.choice["option"] == {"navigator.max_velocity": 0.1}
        assert on.manager.requests == []


def test_without_the_data_nothing_is_decided_and_it_says_what_is_missing() -> None:
    with bench() as on:
        proposal = on.propose({})
        assert proposal.choice["outcome"] == "unchanged"
        assert "nearest is not known" in str(proposal.choice["why"])
        unknown = on.propose({"nearest": 0.3}, utility="navigator.sped")
        assert "navigator.sped is not known" in str(unknown.choice["why"])
        assert on.manager.requests == []


def test_what_the_manager_does_not_carry_out_is_told() -> None:
    with bench() as on:
        on.manager.fates = [Outcome.ROLLED_BACK, "refused"]
        assert on.propose({"nearest": 0.3}).choice["outcome"] == "rolled_back"
        assert on.propose({"nearest": 0.3}).choice["outcome"] == "refused"


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"strategy": "ucb1"}, "inputs.strategy: there is no strategy 'ucb1'; there is: expected_utility"),
        ({"utility": "1 +"}, "inputs.knobs.utility: '1 +' is no expression"),
        ({"assume": {"near": "open('x')"}}, "inputs.knobs.assume.near: 'open' is no function"),
        ({"utility": 3}, "inputs.knobs.utility"),
        ({"options": [{**SPEEDS, "component": "navigato"}]}, "there is no component 'navigato'"),
        ({"options": [{**SPEEDS, "values": [9.0]}]}, "9.0"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(asked: dict[str, Any], told: str) -> None:
    with bench() as on:
        with pytest.raises(CallFailed) as failure:
            on.propose({"nearest": 1.0}, **asked)
        assert told in failure.value.why


def test_it_describes_itself_as_planners_do() -> None:
    with bench() as on:
        found = on.rig.call("planners/forecast/describe", PlannerQuery(), PlannerDescription, timeout=5.0)
        Draft202012Validator.check_schema(as_json(found.inputs))
        assert [strategy.name for strategy in found.strategies] == ["expected_utility"]
        assert "utility" in found.strategies[0].knobs["properties"]
