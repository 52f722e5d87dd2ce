"""Bounds by mini-bucket elimination (Dechter and Rish, Journal of the ACM 50(2), 2003).

A sum of tables over a few slots each is maximised by eliminating one slot after the other: the tables that have it are
added up, and the maximum over its selections is a table over the others. Tables that would grow too large are
maximised in parts, which can only raise the result. So it bounds the sum from above, and knows what goes together.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

MAX_JOINT: Final = 20_000
"""Entries of tables that are added up."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Factor:
    """A table over some slots, which are given by their places in the order of search, ascending."""

    places: tuple[int, ...]
    table: Floats


def factor(scope: Sequence[int], table: Floats) -> Factor:
    """Return the factor of a table whose axes are in any order."""
    order = sorted(range(len(scope)), key=lambda axis: scope[axis])
    return Factor(tuple(scope[axis] for axis in order), table.transpose(order))


@dataclass(frozen=True, eq=False)
class Loss:
    """The loss of bound with each selection of the last place, by the selections of the other ones."""

    earlier: tuple[int, ...]
    rows: Any

    def row(self, chosen: Sequence[int]) -> list[float]:
        """Return the losses, zero or negative, of all selections at a place, after those chosen before it."""
        found = self.rows
        for place in self.earlier:
            found = found[chosen[place]]
        return found  # type: ignore[no-any-return]


@dataclass(frozen=True, eq=False)
class Bound:
    """The bound of a sum of factors: what it is before anything is chosen, and what each selection takes off it."""

    root: float
    losses: list[list[tuple[tuple[int, ...], Floats]]]

    def as_rows(self) -> list[list[Loss]]:
        """Return the losses for each place as lists, which are faster to read one by one."""
        return [[Loss(earlier, table.tolist()) for earlier, table in level] for level in self.losses]


def bound_of(sizes: Sequence[int], factors: Iterable[Factor]) -> Bound:
    """Return the bound of the sum of factors, of which each place has so many selections."""
    root = 0.0
    buckets: list[list[Factor]] = [[] for _ in sizes]
    for each in factors:
        if each.places:
            buckets[each.places[-1]].append(each)
        else:
            root += float(each.table)
    losses: list[list[tuple[tuple[int, ...], Floats]]] = [[] for _ in sizes]
    for place in reversed(range(len(sizes))):
        for joint in _joined(buckets[place], sizes):
            most = joint.table.max(axis=-1)
            with np.errstate(invalid="ignore"):
                lost = joint.table - most[..., np.newaxis]
            lost[np.isnan(lost)] = -math.inf
            losses[place].append((joint.places[:-1], lost))
            if joint.places[:-1]:
                buckets[joint.places[-2]].append(Factor(joint.places[:-1], most))
            else:
                root += float(most)
    return Bound(root, losses)


def _joined(bucket: list[Factor], sizes: Sequence[int]) -> list[Factor]:
    """Return the factors of a bucket, added up as far as their tables stay small."""
    groups: list[tuple[set[int], list[Factor]]] = []
    for each in sorted(bucket, key=lambda each: -each.table.size):
        for places, members in groups:
            if math.prod(sizes[place] for place in places | set(each.places)) <= max(MAX_JOINT, each.table.size):
                places |= set(each.places)
                members.append(each)
                break
        else:
            groups.append((set(each.places), [each]))
    return [_sum(tuple(sorted(places)), members, sizes) for places, members in groups]


def _sum(places: tuple[int, ...], factors: Sequence[Factor], sizes: Sequence[int]) -> Factor:
    total = np.zeros([sizes[place] for place in places])
    for each in factors:
        total += each.table.reshape([sizes[place] if place in each.places else 1 for place in places])
    return Factor(places, total)
