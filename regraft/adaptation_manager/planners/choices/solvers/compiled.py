"""A problem made ready for branch and bound: an order of its slots, and what each selection takes off the bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from regraft.adaptation_manager.planners.choices.problem import Problem
from regraft.adaptation_manager.planners.choices.rules.rules import Clause, Limit, Rule, bits
from regraft.adaptation_manager.planners.choices.solvers.elimination import Bound, Factor, Loss, bound_of, factor
from regraft.adaptation_manager.planners.choices.solvers.multipliers import penalised

MAX_TABLE: Final = 20_000
"""Entries of the table of a clause; a larger one is checked when its last slot is chosen."""

Check = Callable[[Sequence[int], int], bool]
"""Whether a selection of the present place keeps a rule, after those chosen before."""


@dataclass(frozen=True, slots=True)
class Level:
    """One place of a search: its number of selections, and the losses of each."""

    size: int
    worth: list[Loss]
    limits: list[list[Loss]]
    checks: list[Check]


@dataclass(frozen=True, eq=False)
class Compiled:
    """The places of a search in their order; ``room`` is what the limits leave before anything is chosen."""

    worth: Bound
    room: list[float]
    levels: list[Level]
    order: list[int]
    kept: list[list[int]]

    def original(self, chosen: Sequence[int]) -> tuple[int, ...]:
        """Return the combination in the problem's own order and numbers."""
        found = [0] * len(self.order)
        for place, slot in enumerate(self.order):
            found[slot] = self.kept[slot][chosen[place]]
        return tuple(found)


def compiled(problem: Problem, domains: Sequence[int]) -> Compiled:
    """Return a problem made ready, with what is left of its domains."""
    kept = [list(bits(domain)) for domain in domains]
    order = _order(problem)
    place = {slot: at for at, slot in enumerate(order)}
    sizes = [len(kept[slot]) for slot in order]
    limits = [rule for rule in problem.rules if isinstance(rule, Limit)]
    others = [rule for rule in problem.rules if not isinstance(rule, Limit)]
    late = [rule for rule in others if isinstance(rule, Clause) and _size(rule, problem.sizes) > MAX_TABLE]

    def reduced(scope: Sequence[int], table: NDArray[np.float64]) -> Factor:
        return factor([place[slot] for slot in scope], table[np.ix_(*(kept[slot] for slot in scope))])

    together = [reduced(rule.scope(), _forbidding(rule, problem.sizes)) for rule in others if rule not in late]
    terms = [reduced(term.slots, term.worth) if term.slots else Factor((), term.worth) for term in problem.terms]
    uses = [[reduced((slot,), -np.array(amounts)) for slot, amounts in limit.uses] for limit in limits]
    worth = penalised(sizes, [*terms, *together], uses, [limit.bound for limit in limits])
    rooms = [bound_of(sizes, [*used, *together]) for used in uses]
    rows, room_rows = worth.as_rows(), [bound.as_rows() for bound in rooms]
    checks = _checks(late, place, kept)
    levels = [
        Level(sizes[at], rows[at], [each[at] for each in room_rows], checks.get(at, [])) for at in range(len(order))
    ]
    room = [limit.bound + bound.root for limit, bound in zip(limits, rooms, strict=True)]
    return Compiled(worth, room, levels, order, kept)


def _size(rule: Rule, sizes: Sequence[int]) -> int:
    return math.prod(sizes[slot] for slot in rule.scope())


def _forbidding(rule: Rule, sizes: Sequence[int]) -> NDArray[np.float64]:
    assert not isinstance(rule, Limit)
    return np.where(rule.table(sizes), 0.0, -math.inf)


def _checks(late: Sequence[Rule], place: dict[int, int], kept: Sequence[Sequence[int]]) -> dict[int, list[Check]]:
    found: dict[int, list[Check]] = {}
    for rule in late:
        assert isinstance(rule, Clause)
        ways = sorted((place[slot], [bool(mask >> index & 1) for index in kept[slot]]) for slot, mask in rule.ways)
        *earlier, (last, allowed) = ways
        found.setdefault(last, []).append(_check(earlier, allowed))
    return found


def _check(earlier: Sequence[tuple[int, list[bool]]], allowed: list[bool]) -> Check:
    return lambda chosen, selection: allowed[selection] or any(ok[chosen[place]] for place, ok in earlier)


def _order(problem: Problem) -> list[int]:
    """Return the slots in an order in which what is eliminated last first ties few others (least degree first)."""
    neighbours: dict[int, set[int]] = {slot: set() for slot in range(len(problem.sizes))}
    scopes = [rule.scope() for rule in problem.rules if not isinstance(rule, Limit)]
    for scope in (*scopes, *(term.slots for term in problem.terms)):
        for slot in scope:
            neighbours[slot] |= set(scope) - {slot}
    reverse: list[int] = []
    while neighbours:
        slot = min(neighbours, key=lambda each: (len(neighbours[each]), -each))
        tied = neighbours.pop(slot)
        for other in tied:
            neighbours[other] = (neighbours[other] | tied) - {slot, other}
        reverse.append(slot)
    return reverse[::-1]
