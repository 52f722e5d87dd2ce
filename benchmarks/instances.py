"""Random choices: slots whose neighbours often do not go together, broken alternatives, amounts that run short."""

from __future__ import annotations

from random import Random

import numpy as np

from regraft.adaptation_manager.planners.choices.problem import Problem, Term
from regraft.adaptation_manager.planners.choices.rules.rules import Clause, Limit, Rule, relation

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
