"""The rules of one choice, and what each comes from, for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from regraft.adaptation_manager.planners.choices.rules.rules import Clause, Limit, Relation, Rule, Table, relation
from regraft.adaptation_manager.planners.choices.settings import contradict
from regraft.adaptation_manager.planners.choices.slots import Slot


@dataclass(slots=True)
class Rulebook:
    """Rules by their sources: ``texts`` has one for each source."""

    rules: list[Rule] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)

    def add(self, text: str, rules: Iterable[Rule]) -> None:
        """Add the rules that come from one source."""
        source = len(self.texts)
        self.texts.append(text)
        self.rules += (replace(rule, source=source) for rule in rules)

    def exclude(self, text: str, slots: Sequence[Slot], slot: int, alternatives: int) -> None:
        """Exclude the alternatives of a mask from a slot."""
        having = slots[slot].with_alternatives(alternatives)
        self.allow(text, slot, ((1 << len(slots[slot].selections)) - 1) & ~having)

    def allow(self, text: str, slot: int, selections: int) -> None:
        """Allow only the selections of a mask for a slot."""
        self.add(text, [Clause(0, ((slot, selections),))])

    def limit(self, text: str, slots: Sequence[Slot], figure: str, most: float) -> None:
        """Limit the sum of a figure over all alternatives that are chosen."""
        uses = []
        for index, slot in enumerate(slots):
            amounts = [float(each.figures.get(figure, 0.0)) for each in slot.alternatives]
            if any(amounts):
                uses.append((index, tuple(sum((amounts[i] for i in s), 0.0) for s in slot.selections)))
        self.add(text, [Limit(0, figure, most, tuple(uses))] if uses else [])

    def require(self, text: str, scope: tuple[int, ...], kept: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> None:
        """Allow only combinations of some slots that a table allows."""
        if not scope:
            self.add(text, [] if kept.all() else [Clause(0, ((0, 0),))])
        elif len(scope) == 2:
            self.add(text, [relation(0, scope[0], scope[1], kept)])
        elif len(scope) == 1:
            self.add(text, [Clause(0, ((scope[0], sum(1 << i for i, ok in enumerate(kept.tolist()) if ok)),))])
        else:
            self.add(text, [Table(0, scope, kept)])

    def exclude_contradictions(self, slots: Sequence[Slot]) -> None:
        """Exclude that two slots want different values of one thing."""
        subjects = [{s.subject for a in slot.alternatives for s in a.every_setting} for slot in slots]
        for left, right in combinations(range(len(slots)), 2):
            if subjects[left] & subjects[right]:
                rule = _without_contradictions(slots, left, right)
                self.add(f"{slots[left].name} and {slots[right].name} want different values of one thing", [rule])


def _without_contradictions(slots: Sequence[Slot], left: int, right: int) -> Relation:
    one, other = slots[left], slots[right]
    together = [
        [not contradict(one.settings(i), other.settings(j)) for j in range(len(other.selections))]
        for i in range(len(one.selections))
    ]
    return relation(0, left, right, np.array(together, dtype=bool))
