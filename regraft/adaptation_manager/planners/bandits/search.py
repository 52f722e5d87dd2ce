"""Finds the combinations that rules allow: depth-first, cutting off what cannot be completed.

A domain is a bit mask over a dimension's choices: bit ``i`` is set while choice ``i`` is still possible. After every
decision the rules are propagated. A clause of which only one part can still hold makes that part hold. A relation
takes away what has no partner. Parts of the space that no rule ties together are searched one by one. So an impossible
part is not tried again under every combination of the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

MAX_STEPS = 400_000
"""How often one search may apply a rule before it gives up: a few seconds."""

Domains = list[int]


class TooHard(Exception):
    """The search gave up."""


@dataclass(frozen=True, slots=True)
class Clause:
    """Kept if at least one dimension has one of its choices: pairs of a dimension's index and a mask of choices.

    ``source`` is the index of the constraint that it comes from.
    """

    source: int
    ways: tuple[tuple[int, int], ...]

    def scope(self) -> tuple[int, ...]:
        """Return the dimensions that it is about."""
        return tuple(dimension for dimension, _ in self.ways)

    def propagate(self, domains: Domains) -> bool:
        """Take from the domains what breaks the rule; False if nothing is left that keeps it."""
        possible = [(dimension, mask) for dimension, mask in self.ways if domains[dimension] & mask]
        if len(possible) == 1:
            dimension, mask = possible[0]
            domains[dimension] &= mask
        return bool(possible)


@dataclass(frozen=True, slots=True)
class Relation:
    """Kept if the choices of two dimensions go together: for each choice of one, the mask of the other's."""

    source: int
    left: int
    right: int
    partners_of_left: tuple[int, ...]
    partners_of_right: tuple[int, ...]

    def scope(self) -> tuple[int, ...]:
        """Return the dimensions that it is about."""
        return (self.left, self.right)

    def propagate(self, domains: Domains) -> bool:
        """Take from the domains what breaks the rule; False if nothing is left that keeps it."""
        domains[self.left] = _with_partner(domains[self.left], self.partners_of_left, domains[self.right])
        domains[self.right] = _with_partner(domains[self.right], self.partners_of_right, domains[self.left])
        return bool(domains[self.left] and domains[self.right])


Rule = Clause | Relation


def _with_partner(domain: int, partners: tuple[int, ...], others: int) -> int:
    return sum(1 << choice for choice in bits(domain) if partners[choice] & others)


def bits(mask: int) -> Iterator[int]:
    """Yield the indices of the bits that are set, lowest first."""
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest


def parts_of(sizes: Sequence[int], rules: Sequence[Rule]) -> list[tuple[list[int], list[Rule]]]:
    """Return the dimensions in groups that no rule ties together, each with its rules."""
    group = list(range(len(sizes)))
    for rule in rules:
        first, *others = (group[dimension] for dimension in rule.scope())
        group = [first if g in others else g for g in group]
    found: dict[int, tuple[list[int], list[Rule]]] = {}
    for dimension, g in enumerate(group):
        found.setdefault(g, ([], []))[0].append(dimension)
    for rule in rules:
        found[group[rule.scope()[0]]][1].append(rule)
    return list(found.values())


class Search:
    """Walks through the combinations of some dimensions that keep all of ``rules``."""

    def __init__(
        self, sizes: Sequence[int], dimensions: Sequence[int], rules: Sequence[Rule], most_steps: int = MAX_STEPS
    ) -> None:
        """Search among ``dimensions``; ``sizes`` has the number of choices of each dimension there is."""
        self._most_steps = most_steps
        self._full = [(1 << size) - 1 for size in sizes]
        self._dimensions = dimensions
        self._rules = rules
        self._steps = 0
        self._touching: dict[int, list[Rule]] = {dimension: [] for dimension in dimensions}
        for rule in rules:
            for dimension in dict.fromkeys(rule.scope()):
                self._touching[dimension].append(rule)

    def solutions(self, most: int) -> list[tuple[int, ...]]:
        """Return the first ``most`` combinations, each a choice per dimension; raises TooHard."""
        domains = list(self._full)
        if not all(rule.propagate(domains) for rule in self._rules) or not self._settle(domains, self._dimensions):
            return []
        return list(islice(self._below(domains), most))

    def _below(self, domains: Domains) -> Iterator[tuple[int, ...]]:
        open_ones = [dimension for dimension in self._dimensions if domains[dimension].bit_count() > 1]
        if not open_ones:
            yield tuple(domains[dimension].bit_length() - 1 for dimension in self._dimensions)
            return
        decided = min(open_ones, key=lambda dimension: domains[dimension].bit_count())
        for choice in bits(domains[decided]):
            below = list(domains)
            below[decided] = 1 << choice
            if self._settle(below, [decided]):
                yield from self._below(below)

    def _settle(self, domains: Domains, changed: Sequence[int]) -> bool:
        """Propagate until nothing changes; False if a rule cannot be kept."""
        waiting = list(changed)
        while waiting:
            rules = self._touching[waiting.pop()]
            self._steps += len(rules)
            if self._steps > self._most_steps:
                raise TooHard
            for rule in rules:
                before = [domains[dimension] for dimension in rule.scope()]
                if not rule.propagate(domains):
                    return False
                waiting += [d for d, was in zip(rule.scope(), before, strict=True) if domains[d] != was]
        return True
