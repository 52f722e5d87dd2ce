"""Our strategies against MABWiser's, on the same seeded problems: the same choices, or as much earned."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from statistics import fmean, stdev
from typing import Any

import numpy as np
import pytest

from regraft.adaptation_manager.planners.bandits.strategy import Offer, Strategy
from regraft.adaptation_manager.planners.bandits.strategy_registry import Strategies

ARMS = ["a", "b", "c", "d"]
WORTH = [0.3, 0.5, 0.65, 0.4]
ALL = Strategies()

Table = list[list[float]]
Choose = Callable[[int], str]
Learn = Callable[[int, str, float], None]


def policy_of(kind: str, **options: float) -> Any:
    """Return one of MABWiser's policies; its import takes a second, so nothing else waits for it."""
    from mabwiser.mab import LearningPolicy

    return getattr(LearningPolicy, kind)(**options)


def mab_of(policy: Any, seed: int) -> Any:
    """Return a player of MABWiser's."""
    from mabwiser.mab import MAB

    return MAB(ARMS, policy, seed=seed)


def coins(seed: int, rounds: int) -> Table:
    """Return what each arm would earn in each round: 0 or 1."""
    chance = Random(seed)
    return [[float(chance.random() < worth) for worth in WORTH] for _ in range(rounds)]


def shares(seed: int, rounds: int) -> Table:
    """Return what each arm would earn in each round: a part of 1."""
    chance = Random(seed)
    return [[chance.betavariate(4 * worth, 4 * (1 - worth)) for worth in WORTH] for _ in range(rounds)]


def play(table: Table, choose: Choose, learn: Learn) -> tuple[list[str], float]:
    """Return what was chosen, and what it earned in all."""
    chosen, earned = [], 0.0
    for turn, row in enumerate(table):
        arm = choose(turn)
        utility = row[ARMS.index(arm)]
        learn(turn, arm, utility)
        chosen.append(arm)
        earned += utility
    return chosen, earned


def ours(strategy: Strategy[Any], table: Table, seed: int, context: Any = None) -> tuple[list[str], float]:
    """Play with one of our strategies."""
    world: Callable[[int], dict[str, float]] = context or (lambda turn: {})
    return play(
        table,
        lambda turn: ARMS[strategy.choose(Offer(ARMS, {}, world(turn)), Random(f"{seed}/{turn}")).index],
        lambda turn, arm, utility: strategy.learn(arm, utility, world(turn)),
    )


def theirs(policy: Any, table: Table, seed: int, *, each_first: bool, context: Any = None) -> tuple[list[str], float]:
    """Play with one of MABWiser's; it has each arm played once first, if that is how the strategy begins."""
    mab = mab_of(policy, seed)
    known: list[bool] = []

    def choose(turn: int) -> str:
        if each_first and turn < len(ARMS):
            return ARMS[turn]
        if not known:
            return ARMS[0]
        chosen: str = mab.predict([context(turn)] if context else None)
        return chosen

    def learn(turn: int, arm: str, utility: float) -> None:
        fit = mab.partial_fit if known else mab.fit
        fit([arm], [utility], [context(turn)] if context else None)
        known.append(True)

    return play(table, choose, learn)


def new(name: str, **knobs: Any) -> Strategy[Any]:
    return ALL.new(name, ALL.knobs(name, knobs))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("exploration", [0.3, 1.0])
def test_ucb1_chooses_the_same_arms(seed: int, exploration: float) -> None:
    table = shares(seed, 400)
    policy = policy_of("UCB1", alpha=exploration)
    expected, _ = theirs(policy, table, seed, each_first=True)
    assert ours(new("ucb1", exploration=exploration), table, seed)[0] == expected


@pytest.mark.parametrize("seed", range(4))
def test_greedy_without_exploration_chooses_the_same_arms(seed: int) -> None:
    table = shares(seed, 300)
    expected, _ = theirs(policy_of("EpsilonGreedy", epsilon=0.0), table, seed, each_first=True)
    assert ours(new("epsilon_greedy", epsilon=0.0, initial=1.0), table, seed)[0] == expected


@pytest.mark.parametrize("seed", range(4))
def test_linucb_chooses_the_same_arms(seed: int) -> None:
    """With a ridge of 1: MABWiser 2.7.4 takes the ridge for its own inverse until an arm was played."""
    chance = np.random.default_rng(seed)
    worlds = chance.random((300, 2))
    weights = chance.random((4, 2)) / 2
    table = [[float(np.clip(w @ x + chance.normal(0, 0.05), 0, 1)) for w in weights] for x in worlds]
    policy = policy_of("LinUCB", alpha=0.8, l2_lambda=1.0)
    expected, _ = theirs(policy, table, seed, each_first=False, context=lambda turn: [1.0, *worlds[turn]])
    found, _ = ours(
        new("linucb", alpha=0.8, ridge=1.0),
        table,
        seed,
        context=lambda turn: {"x": float(worlds[turn][0]), "y": float(worlds[turn][1])},
    )
    assert found == expected


@pytest.mark.parametrize(
    ("name", "knobs", "policy", "each_first"),
    [
        ("epsilon_greedy", {"epsilon": 0.15}, ("EpsilonGreedy", {"epsilon": 0.15}), True),
        ("thompson", {}, ("ThompsonSampling", {}), False),
        ("random", {}, ("Random", {}), False),
    ],
)
def test_what_draws_at_random_earns_as_much(
    name: str, knobs: dict[str, Any], policy: tuple[str, dict[str, float]], each_first: bool
) -> None:
    """Paired over seeded tables: the mean difference is within three standard errors of none."""
    differences = []
    kind, options = policy
    for seed in range(24):
        table = coins(seed, 250)
        mine = ours(new(name, **knobs), table, seed)[1]
        differences.append(mine - theirs(policy_of(kind, **options), table, seed, each_first=each_first)[1])
    assert abs(fmean(differences)) < 3 * stdev(differences) / len(differences) ** 0.5, differences


def test_thompson_draws_from_the_same_posterior() -> None:
    """After the same history both choose each arm equally often, within four standard errors."""
    chance = Random(5)
    history = [(arm, float(chance.random() < worth)) for arm, worth in zip(ARMS, WORTH, strict=True) for _ in range(12)]
    mab = mab_of(policy_of("ThompsonSampling"), 1)
    mab.fit([arm for arm, _ in history], [int(utility) for _, utility in history])
    strategy = new("thompson")
    for arm, utility in history:
        strategy.learn(arm, utility, {})
    draws = 3000
    expected = [mab.predict() for _ in range(draws)]
    found = [ARMS[strategy.choose(Offer(ARMS), Random(seed)).index] for seed in range(draws)]
    for arm in ARMS:
        share = (expected.count(arm) + found.count(arm)) / (2 * draws)
        spread = (2 * share * (1 - share) / draws) ** 0.5
        assert abs(expected.count(arm) - found.count(arm)) / draws < 4 * spread + 1e-9
