"""The bandits under odd requests: numbers that would spoil what was learned are refused, and it stays as it was."""

from __future__ import annotations

import math
from typing import Any

import pytest

from regraft import CallFailed
from regraft.adaptation_manager.planners.bandits import bandit_planner
from regraft.adaptation_manager.planners.choices.space import options_of
from tests.planners.parts import SPEEDS, bench


@pytest.mark.parametrize("number", [1e200, -1e200, 1.7e308, 2.0**62])
def test_a_context_with_numbers_that_nothing_can_be_learned_on_is_refused(number: float) -> None:
    with bench() as bandits:
        first = bandits.propose("linucb", context={"darkness": 0.5})
        credit = bandits.earn(first, 0.7)
        learned = bandits.propose("linucb", context={"darkness": 0.5}, credit=credit)
        before = bandits.planner.snapshot()
        with pytest.raises(
            CallFailed, match=r"inputs\.knobs\.features: the context's 'far' is .*, must be within 1e\+06"
        ):
            bandits.propose("linucb", context={"far": number})
        assert bandits.planner.snapshot() == before
        assert finite(before)
        assert learned.choice["credit"]["credited"]
        only = {"features": ["darkness"]}
        assert bandits.propose("linucb", context={"darkness": 0.5, "far": number}, knobs=only).choice["why"]


def finite(value: Any) -> bool:
    """Tell whether all numbers in plain data are finite."""
    if isinstance(value, dict):
        return all(map(finite, value.values()))
    if isinstance(value, list | tuple):
        return all(map(finite, value))
    return not isinstance(value, float) or math.isfinite(value)


@pytest.mark.parametrize(
    "strategy", ["random", "ucb1", "ucb_tuned", "epsilon_greedy", "sliding_window_ucb", "thompson", "linucb"]
)
def test_whatever_utility_is_told_what_was_learned_stays_finite(strategy: str) -> None:
    with bench() as bandits:
        for utility in (1.7e308, -1.7e308, 5e-324, 2**63 - 1):
            chosen = bandits.propose(strategy, context={"a": 1e6})
            bandits.propose(strategy, context={"a": -1e6}, credit=bandits.earn(chosen, utility))
        assert finite(bandits.planner.snapshot())


def test_a_range_of_utility_too_large_to_be_told_is_refused() -> None:
    with bench() as bandits:
        with pytest.raises(CallFailed, match=r"inputs\.knobs\.high: is 1e\+308, too far from 'low'"):
            bandits.propose(knobs={"low": -1e308, "high": 1e308})
        assert bandits.propose(knobs={"low": 0, "high": 1e308}).ticket


def test_of_very_many_problems_the_first_are_told() -> None:
    with bench() as bandits:
        options = ({**SPEEDS, "values": [f"v{n}" for n in range(1000)]},)
        with pytest.raises(CallFailed) as refused:
            bandits.propose(options=options)
        assert "inputs.options.0.values: 'v0': must be a number" in refused.value.why
        assert refused.value.why.endswith("and 990 more")


def test_stamps_of_refused_credits_can_be_told_apart() -> None:
    with bench() as bandits:
        bandits.rig.advance(10_000.25)
        chosen = bandits.propose(settle=0.25)
        credit = {"ticket": chosen.ticket, "utility": 0.5, "from": 10_000.25, "to": 10_001.0}
        refused = bandits.propose(credit=credit).choice["credit"]
        assert not refused["credited"]
        assert refused["why"].startswith("measured from 10000.25, but ")
        assert refused["why"].endswith(" measured from 10000.5 on")


def test_a_space_without_options_is_searched_once_however_often_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    searches: list[Any] = []

    def counted(*given: Any) -> Any:
        searches.append(given)
        return options_of(*given)

    monkeypatch.setattr(bandit_planner, "options_of", counted)
    with bench() as bandits:
        for _ in range(5):
            with pytest.raises(CallFailed, match="leaves no option"):
                bandits.propose(constraints=[{"forbid": {"navigator.max_velocity": {">": 0}}}])
    assert len(searches) == 1
