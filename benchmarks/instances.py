"""Random choices: slots whose neighbours often do not go together, broken alternatives, amounts that run short."""

from __future__ import annotations

from random import Random

import numpy as np

from regraft.adaptation_manager.planners.choices.problem import UNKNOWN, Problem, Term
from regraft.adaptation_manager.planners.choices.rules.rules import Clause, Limit, Rule, Table, relation

INCOMPATIBLE, FAULTY = 0.3, 0.1
AMOUNTS = 4


def chain(rng: Random, slots: int, alternatives: int, share: float) -> Problem:
    """Return an instance as in a synthesis of configurations: ``share`` of the greatest use of each amount is there."""
    rules: list[Rule] = []
    for slot in range(slots - 1):
        together = [[rng.random() >= INCOMPATIBLE for _ in range(alternatives)] for _ in range(alternatives)]
        rules.append(relation(0, slot, slot + 1, np.array(together)))
    for slot in range(slots):
        working = sum(1 << index for index in range(alternatives) if rng.random() >= FAULTY)
        rules.append(Clause(1, ((slot, working or 1),)))
    for amount in range(AMOUNTS):
        uses = tuple((slot, tuple(rng.random() for _ in range(alternatives))) for slot in range(slots))
        rules.append(Limit(2, f"amount {amount}", share * slots, uses))
    worth = [np.array([rng.random() for _ in range(alternatives)]) for _ in range(slots)]
    return Problem((alternatives,) * slots, tuple(rules), tuple(Term((s,), each) for s, each in enumerate(worth)))


def tangled(rng: Random, most: int) -> Problem:
    """Return any instance of at most so many combinations: rules and terms over one to three slots, unknown worths."""
    sizes = [rng.randint(1, 6)]
    while len(sizes) < 8 and rng.random() < 0.9 and int(np.prod(sizes)) * 6 <= most:
        sizes.append(rng.randint(1, 6))
    rules: list[Rule] = []
    for number in range(rng.randint(0, 6)):
        scope = tuple(rng.sample(range(len(sizes)), min(len(sizes), rng.randint(1, 3))))
        kept = np.array(_table(rng, [sizes[slot] for slot in scope])) > rng.choice((0.1, 0.4))
        form = rng.randint(0, 2)
        if form == 0:
            ways = tuple((slot, rng.getrandbits(sizes[slot])) for slot in scope)
            rules.append(Clause(number, ways))
        elif len(scope) == 2:
            rules.append(relation(number, scope[0], scope[1], kept))
        else:
            rules.append(Table(number, scope, kept))
    for number in range(rng.randint(0, 2)):
        uses = tuple((slot, tuple(rng.randint(-1, 4) * 0.1 for _ in range(size))) for slot, size in enumerate(sizes))
        rules.append(Limit(9, f"amount {number}", rng.choice((0.1, 0.25, 0.4)) * len(sizes), uses))
    terms = []
    for _ in range(rng.randint(0, 5)):
        scope = tuple(rng.sample(range(len(sizes)), min(len(sizes), rng.randint(0, 3))))
        worth = np.array(_table(rng, [sizes[slot] for slot in scope])) * 2.0 - 1.0
        terms.append(Term(scope, np.where(worth < rng.choice((-2.0, -0.9)), UNKNOWN, worth)))
    return Problem(tuple(sizes), tuple(rules), tuple(terms))


def _table(rng: Random, shape: list[int]) -> object:
    return [_table(rng, shape[1:]) for _ in range(shape[0])] if shape else rng.random()
