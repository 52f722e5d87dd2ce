"""Finds the combinations that rules allow: depth-first, cutting off what cannot be completed.

After every decision the rules are propagated. A clause of which only one part can still hold makes that part hold. A
relation takes away what has no partner. Parts of the space that no rule ties together are searched one by one. So an
impossible part is not tried again under every combination of the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice

from regraft.adaptation_manager.planners.choices.rules.rules import Domains, Rule, bits

MAX_STEPS = 400_000
"""How often one search may apply a rule before it gives up: a few seconds."""


class TooHard(Exception):
    """The search gave up."""


def parts_of(sizes: Sequence[int], rules: Sequence[Rule]) -> list[tuple[list[int], list[Rule]]]:
    """Return the slots in groups that no rule ties together, each with its rules."""
    group = list(range(len(sizes)))
    for rule in rules:
        first, *others = (group[slot] for slot in rule.scope())
        group = [first if g in others else g for g in group]
    found: dict[int, tuple[list[int], list[Rule]]] = {}
    for slot, g in enumerate(group):
        found.setdefault(g, ([], []))[0].append(slot)
    for rule in rules:
        found[group[rule.scope()[0]]][1].append(rule)
    return list(found.values())


class Search:
    """Walks through the combinations of some slots that keep all of ``rules``."""

    def __init__(
        self, sizes: Sequence[int], slots: Sequence[int], rules: Sequence[Rule], most_steps: int = MAX_STEPS
    ) -> None:
        """Search among ``slots``; ``sizes`` has the number of selections of each slot there is."""
        self._most_steps = most_steps
        self._full = [(1 << size) - 1 for size in sizes]
        self._slots = slots
        self._rules = rules
        self._steps = 0
        self._touching: dict[int, list[Rule]] = {slot: [] for slot in slots}
        for rule in rules:
            for slot in dict.fromkeys(rule.scope()):
                self._touching[slot].append(rule)

    def reduced(self) -> Domains | None:
        """Return what is left of each slot's selections by what follows from the rules alone; None if nothing is."""
        domains = list(self._full)
        kept = all(domains) and all(rule.propagate(domains) for rule in self._rules)
        return domains if kept and self._settle(domains, self._slots) else None

    def solutions(self, most: int) -> list[tuple[int, ...]]:
        """Return the first ``most`` combinations, each a selection per slot; raises TooHard."""
        domains = self.reduced()
        return [] if domains is None else list(islice(self._below(domains), most))

    def _below(self, domains: Domains) -> Iterator[tuple[int, ...]]:
        open_ones = [slot for slot in self._slots if domains[slot].bit_count() > 1]
        if not open_ones:
            yield tuple(domains[slot].bit_length() - 1 for slot in self._slots)
            return
        decided = min(open_ones, key=lambda slot: domains[slot].bit_count())
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
                before = [domains[slot] for slot in rule.scope()]
                if not rule.propagate(domains):
                    return False
                waiting += [d for d, was in zip(rule.scope(), before, strict=True) if domains[d] != was]
        return True
