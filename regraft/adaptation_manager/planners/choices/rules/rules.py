"""Rules: which selections of several slots go together.

A domain is a bit mask over a slot's selections: bit ``i`` is set while selection ``i`` is still possible.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Domains = list[int]

ROUNDING = 1e-9
"""The share of a limit by which a sum of amounts may exceed it: floats add up inexactly."""


def bits(mask: int) -> Iterator[int]:
    """Yield the indices of the bits that are set, lowest first."""
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest


@dataclass(frozen=True, slots=True)
class Clause:
    """Kept if at least one slot has one of its selections: pairs of a slot's index and a mask of selections.

    ``source`` is the index of the constraint that it comes from.
    """

    source: int
    ways: tuple[tuple[int, int], ...]

    def scope(self) -> tuple[int, ...]:
        """Return the slots that it is about."""
        return tuple(slot for slot, _ in self.ways)

    def propagate(self, domains: Domains) -> bool:
        """Take from the domains what breaks the rule; False if nothing is left that keeps it."""
        possible = [(slot, mask) for slot, mask in self.ways if domains[slot] & mask]
        if len(possible) == 1:
            slot, mask = possible[0]
            domains[slot] &= mask
        return bool(possible)

    def table(self, sizes: Sequence[int]) -> NDArray[np.bool_]:
        """Return for each combination of its slots' selections whether it is kept."""
        kept = np.zeros([sizes[slot] for slot in self.scope()], dtype=bool)
        for axis, (slot, mask) in enumerate(self.ways):
            shape = [1] * kept.ndim
            shape[axis] = -1
            kept |= np.array([bool(mask >> index & 1) for index in range(sizes[slot])]).reshape(shape)
        return kept


@dataclass(frozen=True, slots=True)
class Relation:
    """Kept if the selections of two slots go together: for each selection of one, the mask of the other's."""

    source: int
    left: int
    right: int
    partners_of_left: tuple[int, ...]
    partners_of_right: tuple[int, ...]

    def scope(self) -> tuple[int, ...]:
        """Return the slots that it is about."""
        return (self.left, self.right)

    def propagate(self, domains: Domains) -> bool:
        """Take from the domains what breaks the rule; False if nothing is left that keeps it."""
        domains[self.left] = _with_partner(domains[self.left], self.partners_of_left, domains[self.right])
        domains[self.right] = _with_partner(domains[self.right], self.partners_of_right, domains[self.left])
        return bool(domains[self.left] and domains[self.right])

    def table(self, sizes: Sequence[int]) -> NDArray[np.bool_]:
        """Return for each combination of its slots' selections whether it is kept."""
        rights = range(sizes[self.right])
        return np.array([[bool(mask >> index & 1) for index in rights] for mask in self.partners_of_left])


def relation(source: int, left: int, right: int, together: NDArray[np.bool_]) -> Relation:
    """Return the relation of two slots by a table of what goes together."""
    return Relation(source, left, right, _masks(together), _masks(together.T))


def _masks(together: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(sum(1 << int(index) for index in np.flatnonzero(row)) for row in together)


def _with_partner(domain: int, partners: tuple[int, ...], others: int) -> int:
    return sum(1 << choice for choice in bits(domain) if partners[choice] & others)


@dataclass(frozen=True, eq=False)
class Table:
    """Kept where a table of the selections of several slots has True."""

    source: int
    slots: tuple[int, ...]
    kept: NDArray[np.bool_]

    def scope(self) -> tuple[int, ...]:
        """Return the slots that it is about."""
        return self.slots

    def propagate(self, domains: Domains) -> bool:
        """Take from the domains what breaks the rule; False if nothing is left that keeps it."""
        places = [list(bits(domains[slot])) for slot in self.slots]
        left = self.kept[np.ix_(*places)]
        for axis, slot in enumerate(self.slots):
            others = tuple(other for other in range(left.ndim) if other != axis)
            supported = np.atleast_1d(left.any(axis=others)).tolist()
            domains[slot] = sum(1 << place for place, kept in zip(places[axis], supported, strict=True) if kept)
        return bool(left.any())

    def table(self, sizes: Sequence[int]) -> NDArray[np.bool_]:
        """Return for each combination of its slots' selections whether it is kept."""
        return self.kept


@dataclass(frozen=True, slots=True)
class Limit:
    """Kept if what the selections of all slots use of one amount adds up to at most ``most``.

    ``uses`` has the slots that use some of it, and how much each of their selections does.
    """

    source: int
    name: str
    most: float
    uses: tuple[tuple[int, tuple[float, ...]], ...]

    @property
    def bound(self) -> float:
        """The greatest sum that counts as within the limit."""
        return self.most + ROUNDING * max(1.0, abs(self.most))

    def scope(self) -> tuple[int, ...]:
        """Return the slots that it is about."""
        return tuple(slot for slot, _ in self.uses)

    def propagate(self, domains: Domains) -> bool:
        """Take from the domains what breaks the rule; False if nothing is left that keeps it."""
        least = {slot: min(amounts[index] for index in bits(domains[slot])) for slot, amounts in self.uses}
        room = self.bound - sum(least.values())
        if room < 0:
            return False
        for slot, amounts in self.uses:
            domain = domains[slot]
            domains[slot] = sum(1 << i for i in bits(domain) if amounts[i] - least[slot] <= room)
        return True


Rule = Clause | Relation | Table | Limit
