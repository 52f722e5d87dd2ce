"""The strategies choose as their papers say."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from random import Random
from statistics import fmean
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.adaptation_manager.planners.bandits.strategies.averages import Average
from regraft.adaptation_manager.planners.bandits.strategies.ucb import Ucb1, Ucb1Knobs, UcbTuned
from regraft.adaptation_manager.planners.bandits.strategy import Knobs, Offer, Strategy
from regraft.adaptation_manager.planners.bandits.strategy_registry import Strategies

ALL = Strategies()
LEARNING = tuple(name for name in ALL.names() if name != "random")
UNIT = st.floats(0.0, 1.0)


def new(name: str, **knobs: Any) -> Strategy[Any]:
    return ALL.new(name, ALL.knobs(name, knobs))


def play(
    strategy: Strategy[Any],
    keys: list[str],
    earn: Callable[[int, str], float],
    rounds: int,
    seed: int = 0,
    context: Callable[[int], dict[str, float]] = lambda _: {},
) -> list[str]:
    """Return what a strategy chose, round by round."""
    chosen = []
    for turn in range(rounds):
        offer = Offer(keys, {}, context(turn))
        key = keys[strategy.choose(offer, Random(f"{seed}/{turn}")).index]
        strategy.learn(key, earn(turn, key), offer.context)
        chosen.append(key)
    return chosen


def average_of(utilities: list[float]) -> Average:
    average = Average()
    for utility in utilities:
        average.add(utility)
    return average


@given(st.lists(UNIT, min_size=1, max_size=20), st.integers(1, 1000))
def test_ucb_tuned_is_the_index_of_the_paper_with_its_cap(utilities: list[float], others: int) -> None:
    n_k, n = len(utilities), len(utilities) + others
    v = float(np.var(utilities)) + math.sqrt(2 * math.log(n) / n_k)
    expected = fmean(utilities) + math.sqrt(math.log(n) / n_k * min(0.25, v))
    assert UcbTuned(Knobs()).index(average_of(utilities), n) == pytest.approx(expected, abs=1e-9)


def test_the_cap_of_ucb_tuned_binds_where_little_is_known() -> None:
    once = UcbTuned(Knobs()).index(average_of([0.5]), 100)
    assert once == pytest.approx(0.5 + math.sqrt(math.log(100) * 0.25))
    often = UcbTuned(Knobs()).index(average_of([0.5] * 10_000), 10_001)
    assert often == pytest.approx(0.5 + math.sqrt(math.log(10_001) / 10_000 * math.sqrt(2 * math.log(10_001) / 10_000)))


@given(st.lists(UNIT, min_size=1, max_size=20), st.integers(1, 1000), st.floats(0.0, 3.0))
def test_ucb1_is_the_index_of_the_paper(utilities: list[float], others: int, exploration: float) -> None:
    n = len(utilities) + others
    expected = fmean(utilities) + exploration * math.sqrt(2 * math.log(n) / len(utilities))
    ucb = Ucb1(Ucb1Knobs(exploration=exploration))
    assert ucb.index(average_of(utilities), n) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", ["epsilon_greedy", "ucb1", "ucb_tuned", "sliding_window_ucb"])
def test_every_option_is_tried_before_one_is_tried_again(name: str) -> None:
    strategy = new(name, **({"epsilon": 0.0} if name == "epsilon_greedy" else {}))
    keys = list("abcde")
    assert play(strategy, keys, lambda _, key: 0.99 if key == "a" else 0.1, 5) == keys


@pytest.mark.parametrize("name", LEARNING)
def test_the_best_option_is_found(name: str) -> None:
    worth = {"a": 0.2, "b": 0.8, "c": 0.5}
    chance = Random(7)
    chosen = play(new(name), list(worth), lambda _, key: float(chance.random() < worth[key]), 600)
    counts = Counter(chosen[300:])
    # A window of 50 never stops exploring much.
    assert counts["b"] > (120 if name == "sliding_window_ucb" else 180), counts


def test_a_change_of_the_best_option_is_followed_within_the_window() -> None:
    def earn(turn: int, key: str) -> float:
        best = "a" if turn < 500 else "b"
        return 0.9 if key == best else 0.1

    chosen = play(new("sliding_window_ucb", window=40), ["a", "b", "c"], earn, 1000)
    assert Counter(chosen[400:500])["a"] > 70
    assert Counter(chosen[600:])["b"] > 280
    stubborn = play(new("ucb_tuned"), ["a", "b", "c"], earn, 1000)
    assert Counter(stubborn[500:600])["b"] < Counter(chosen[500:600])["b"]


def test_what_has_left_the_window_does_not_count() -> None:
    long, short = new("sliding_window_ucb", window=10), new("sliding_window_ucb", window=10)
    for utility in (0.9, 0.8, 0.7):
        long.learn("a", utility, {})
    for strategy in (long, short):
        for turn in range(10):
            strategy.learn("ab"[turn % 2], 0.1 * turn, {})
    offer = Offer(["a", "b"])
    assert long.choose(offer, Random(0)) == short.choose(offer, Random(0))
    bound = 0.5 + math.sqrt(0.6 * math.log(10) / 5)
    assert long.choose(offer, Random(0)).why == f"best index, {bound:.4g} with a mean of 0.5"
    for _ in range(10):
        long.learn("b", 0.0, {})
    assert long.choose(offer, Random(0)).why == "not tried within the window"


def test_linucb_learns_which_option_is_best_in_which_context() -> None:
    dark = [turn % 2 for turn in range(400)]
    chosen = play(
        new("linucb", alpha=0.5),
        ["onboard", "corner"],
        lambda turn, key: 0.9 if (key == "corner") == bool(dark[turn]) else 0.2,
        400,
        context=lambda turn: {"darkness": float(dark[turn])},
    )
    right = [(key == "corner") == bool(d) for key, d in zip(chosen, dark, strict=True)]
    assert sum(right[100:]) > 290


def test_linucb_takes_a_number_that_comes_later_into_what_it_knows() -> None:
    strategy = new("linucb")
    strategy.learn("a", 0.5, {})
    strategy.learn("a", 0.7, {"dark": 1.0})
    strategy.learn("b", 0.1, {"near": 0.3})
    a, theta = np.array([[3.0, 1.0], [1.0, 2.0]]), np.array([1.2, 0.7])
    x = np.array([1.0, 0.5])
    spread = np.linalg.solve(a, x)
    assert strategy.choose(Offer(["a"], {}, {"dark": 0.5}), Random(0)).why == (
        f"best bound in this context, {spread @ theta + math.sqrt(x @ spread):.4g}"
    )


def test_linucb_learns_on_computed_numbers_and_leaves_out_what_cannot_be_computed() -> None:
    computed = {"near": "1.0 if nearest < 0.5 else 0.0", "odd": "missing + 1"}
    strategy = new("linucb", computed=computed, features=("near", "odd"), alpha=0.5)
    assert strategy.relevant({"nearest": 0.3, "other": 7.0}) == {"near": 1.0}
    chosen = play(
        strategy,
        ["slow", "fast"],
        lambda turn, key: 0.9 if (key == "slow") == (turn % 2 == 0) else 0.2,
        400,
        context=lambda turn: strategy.relevant({"nearest": 0.3 if turn % 2 == 0 else 2.0}),
    )
    right = [(key == "slow") == (turn % 2 == 0) for turn, key in enumerate(chosen)]
    assert sum(right[100:]) > 290


@pytest.mark.parametrize("name", ALL.names())
@given(data=st.data())
@settings(max_examples=25, deadline=None)
def test_what_is_learned_survives_keeping_reordering_and_other_options(name: str, data: st.DataObject) -> None:
    keys = list("abcdef")
    strategy = new(name)
    for _ in range(data.draw(st.integers(0, 30))):
        strategy.learn(data.draw(st.sampled_from(keys)), data.draw(UNIT), {"x": data.draw(UNIT)})
    again = new(name)
    again.restore(strategy.state())
    assert again.state() == strategy.state()
    shuffled = data.draw(st.permutations([*keys, "new"]))
    offer = Offer(shuffled, {}, {"x": data.draw(UNIT)})
    seed = data.draw(st.integers(0, 5))
    one, other = strategy.choose(offer, Random(seed)), again.choose(offer, Random(seed))
    assert one == other
    assert 0 <= one.index < len(shuffled)


@pytest.mark.parametrize("name", ["ucb1", "ucb_tuned", "linucb"])
def test_the_choice_does_not_depend_on_the_order_of_the_options(name: str) -> None:
    worth = {key: 0.05 + 0.1 * index for index, key in enumerate("abcdefg")}
    strategy = new(name)
    for key, utility in worth.items():
        strategy.learn(key, utility, {})
    for seed in range(10):
        keys = list(worth)
        Random(seed).shuffle(keys)
        assert keys[strategy.choose(Offer(keys), Random(0)).index] == "g"


@pytest.mark.parametrize("name", ["epsilon_greedy", "ucb1", "ucb_tuned", "sliding_window_ucb", "linucb"])
def test_an_option_that_never_earns_a_credit_does_not_keep_the_strategy_waiting(name: str) -> None:
    strategy = new(name, **({"epsilon": 0.0} if name == "epsilon_greedy" else {}))
    strategy.learn("b", 0.5, {})
    silent = Offer(["a", "b"], {"a": 2})
    assert strategy.choose(silent, Random(0)).index == 0
    assert strategy.choose(Offer(["a", "b"], {"a": 3}), Random(0)).index == 1


@pytest.mark.parametrize("name", ALL.names())
def test_where_no_option_earns_a_credit_one_is_chosen_all_the_same(name: str) -> None:
    assert new(name).choose(Offer(["a", "b"], {"a": 3, "b": 3}), Random(0)).index in (0, 1)


@pytest.mark.parametrize("name", ALL.names())
def test_ten_thousand_options_are_no_trouble(name: str) -> None:
    strategy = new(name)
    keys = [str(index) for index in range(10_000)]
    strategy.learn("77", 0.9, {"x": 1.0})
    assert 0 <= strategy.choose(Offer(keys, {}, {"x": 0.5}), Random(0)).index < 10_000
