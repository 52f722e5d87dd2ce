"""Slots: what there is to choose, from which alternatives, and how many of them."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from math import comb
from typing import Final

from regraft.adaptation_manager.planners.choices.settings import Kind, Setting, contradict, identity
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage

MAX_SELECTIONS: Final = 1000
"""Ways to fill one slot."""

Figure = bool | float | str


@dataclass(frozen=True, slots=True)
class Alternative:
    """One way, or a part of one, to fill a slot: all that then should be.

    Constraints and expressions know it by ``name``. ``figures`` are what it brings along: amounts that it uses, its
    impact on qualities. ``otherwise`` is what should be where it is not chosen.
    """

    name: PlainValue
    settings: tuple[Setting, ...] = ()
    figures: dict[str, Figure] = field(default_factory=dict)
    otherwise: tuple[Setting, ...] = ()

    @property
    def every_setting(self) -> tuple[Setting, ...]:
        """All that it may set, chosen or not."""
        return (*self.settings, *self.otherwise)


@dataclass(frozen=True)
class Slot:
    """A choice to be made: of ``alternatives``, at least ``least`` and at most ``most``."""

    name: str
    alternatives: tuple[Alternative, ...]
    least: int = 1
    most: int = 1

    def __post_init__(self) -> None:
        count = sum(comb(len(self.alternatives), size) for size in range(self.least, self.most + 1))
        if count > MAX_SELECTIONS:
            raise BadMessage(f"has {count} ways to choose, must have at most {MAX_SELECTIONS}")

    @property
    def is_single(self) -> bool:
        """Whether exactly one alternative is chosen."""
        return self.least == self.most == 1

    @cached_property
    def selections(self) -> tuple[tuple[int, ...], ...]:
        """All ways to fill the slot: the indices of the alternatives, fewest first, else in their order."""
        sizes = range(self.least, min(self.most, len(self.alternatives)) + 1)
        every = (chosen for size in sizes for chosen in combinations(range(len(self.alternatives)), size))
        return tuple(chosen for chosen in every if not self._contradicts_itself(chosen))

    @cached_property
    def values(self) -> tuple[PlainValue, ...]:
        """The name of each selection: that of the alternative, or a list of names where there may be several."""
        if self.is_single:
            return tuple(alternative.name for alternative in self.alternatives)
        return tuple([self.alternatives[index].name for index in selection] for selection in self.selections)

    def settings(self, selection: int) -> tuple[Setting, ...]:
        """Return all that should be under one of the selections: what is chosen goes before what is not."""
        chosen = self.selections[selection]
        wanted = [s for index in chosen for s in self.alternatives[index].settings]
        wanted += [s for i, each in enumerate(self.alternatives) if i not in chosen for s in each.otherwise]
        found: dict[tuple[str, Kind, str], Setting] = {}
        for setting in wanted:
            found.setdefault(setting.subject, setting)
        return tuple(found.values())

    def index_of(self, name: PlainValue) -> int | None:
        """Return the index of the alternative of a name, None for any other name."""
        wanted = identity(name)
        return next((i for i, each in enumerate(self.alternatives) if identity(each.name) == wanted), None)

    def with_alternatives(self, mask: int) -> int:
        """Return which selections have one of the alternatives of a mask, as a mask."""
        return sum(1 << i for i, chosen in enumerate(self.selections) if any(mask >> index & 1 for index in chosen))

    def within_alternatives(self, mask: int) -> int:
        """Return which selections have alternatives of a mask, and no others, as a mask."""
        every = enumerate(self.selections)
        return sum(1 << i for i, chosen in every if chosen and all(mask >> index & 1 for index in chosen))

    def _contradicts_itself(self, chosen: tuple[int, ...]) -> bool:
        parts = [self.alternatives[index].settings for index in chosen]
        return any(contradict(one, other) for one, other in combinations(parts, 2))


def varied(component: str, kind: Kind, member: str, values: Sequence[PlainValue], name: str) -> Slot:
    """Return the slot in which one thing is varied, each value being an alternative of its own."""
    return Slot(name, tuple(Alternative(value, (Setting(component, kind, member, value),)) for value in values))


@dataclass(frozen=True, slots=True)
class Option:
    """One choice for every slot. Options of equal content have equal keys, however they were listed.

    ``values`` are the names of what is chosen, ``settings`` all that then should be. ``selections`` has the number of
    the selection in each slot.
    """

    key: str
    values: tuple[PlainValue, ...]
    settings: tuple[Setting, ...]
    selections: tuple[int, ...] = ()


def option_of(slots: Sequence[Slot], selections: Sequence[int]) -> Option:
    """Return the option with one selection for each slot; what slots are called is not part of its content."""
    chosen = list(zip(slots, selections, strict=True))
    settings = tuple(setting for slot, selection in chosen for setting in slot.settings(selection))
    parts = sorted(setting.content for setting in settings)
    key = hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]
    return Option(key, tuple(slot.values[selection] for slot, selection in chosen), settings, tuple(selections))
