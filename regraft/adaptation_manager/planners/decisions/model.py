"""A decision as its file describes it."""

from __future__ import annotations

from dataclasses import dataclass, field

from regraft.adaptation_manager.planners.choices.rules.rules import Rule
from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.bus_schema.encoding.reading import Reading
from regraft.bus_schema.model.expressions import Expression


@dataclass(frozen=True, slots=True)
class ContextEntry:
    """A named number or text about the world.

    It is a ``reading`` of a topic, or whether a requirement is met, or whether a component has failed. It may also come
    with each ``request``. After ``stale_after`` seconds without news it is unknown.
    """

    name: str
    topic: str = ""
    reading: Reading | None = None
    stale_after: float | None = None
    requirement: str = ""
    component: str = ""
    request: str = ""


@dataclass(frozen=True, slots=True)
class Requirement:
    """A constraint by an expression: what must be true of a choice; ``path`` is its field, ``text`` names it."""

    path: str
    text: str
    expression: Expression


@dataclass(frozen=True, slots=True)
class AmountLimit:
    """A constraint on the sum of a figure over all that is chosen."""

    path: str
    text: str
    figure: str
    most: Expression


@dataclass(frozen=True, slots=True)
class DecisionQuality:
    """A quality by its two expressions: as it is measured, and as it is estimated for what does not run yet."""

    name: str
    measured: Expression | None = None
    estimated: Expression | None = None


@dataclass(frozen=True, slots=True)
class Fault:
    """A condition under which alternatives are excluded (masks by slot), or some are prescribed (alternatives by slot).

    Where the condition is not known, there is no fault.
    """

    name: str
    when: Expression
    excludes: tuple[tuple[int, int], ...] = ()
    prescribes: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Triggers:
    """When a planner decides by itself: every so many seconds, when a fault comes or goes, when a requirement turns.

    It also decides on demand, with any triggers.
    """

    every: float | None = None
    on_fault: bool = False
    on_requirement: tuple[str, ...] = ()

    @property
    def are_given(self) -> bool:
        """Whether the planner decides by itself at all."""
        return self.every is not None or self.on_fault or bool(self.on_requirement)


@dataclass(frozen=True)
class Decision:
    """Slots to choose for, the context that is known, the rules to keep, and what a choice is worth.

    ``rules`` are pairs of a text for people and the rules that a constraint comes to. ``low`` and ``high`` are the
    range of the utility, for planners that learn. ``settle`` seconds after a change its effect can be measured.
    """

    name: str
    file: str
    context: tuple[ContextEntry, ...]
    slots: tuple[Slot, ...]
    utility: Expression
    rules: tuple[tuple[str, tuple[Rule, ...]], ...] = ()
    requirements: tuple[Requirement, ...] = ()
    limits: tuple[AmountLimit, ...] = ()
    qualities: tuple[DecisionQuality, ...] = ()
    weights: dict[str, Expression] = field(default_factory=dict)
    assume: tuple[tuple[str, Expression], ...] = ()
    margin: float = 0.0
    low: float = 0.0
    high: float = 1.0
    settle: float = 0.0
    faults: tuple[Fault, ...] = ()
    triggers: Triggers = Triggers()

    def estimated(self) -> dict[str, Expression]:
        """Return the expressions of names where qualities are estimated."""
        known = {q.name: q.estimated for q in self.qualities if q.estimated is not None}
        return {**self.weights, **known}

    def measured(self) -> dict[str, Expression]:
        """Return the expressions of names where qualities are measured."""
        known = {q.name: q.measured for q in self.qualities if q.measured is not None}
        return {**self.weights, **known}
