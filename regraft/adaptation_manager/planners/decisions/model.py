"""A decision as its file describes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from regraft.adaptation_manager.planners.choices.objective import TOTAL
from regraft.adaptation_manager.planners.choices.rules.rules import Rule
from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.bus_schema.encoding.reading import Reading
from regraft.bus_schema.model.expressions import Expression

NO_COMPONENTS: Final = (TOTAL, "qualities")
"""The first parts of names that are of no component: sums of figures, and requirements that come with a request."""


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

    def measured_names(self, quality: DecisionQuality | None = None) -> tuple[str, ...]:
        """Return the qualities of components, such as ``navigator.speed``, by which one quality or all are measured."""
        measured = [each.measured for each in ((quality,) if quality else self.qualities) if each.measured is not None]
        own = {slot.name for slot in self.slots}
        names = dict.fromkeys(name for expression in measured for name in expression.names)
        return tuple(
            n for n in names if "." in n and n.rpartition(".")[0] not in own and n.split(".")[0] not in NO_COMPONENTS
        )


def expressions_of(decision: Decision) -> Iterator[tuple[str, Expression]]:
    """Yield all expressions of a decision, each with its field."""
    yield "objective.utility", decision.utility
    yield from ((f"objective.weights.{name}", each) for name, each in decision.weights.items())
    yield from ((f"objective.assume.{name}", each) for name, each in decision.assume)
    for quality in decision.qualities:
        field = f"qualities.{quality.name}"
        both = {f"{field}.measured": quality.measured, f"{field}.estimated": quality.estimated}
        if quality.measured is quality.estimated:
            both = {field: quality.measured}
        yield from ((path, expression) for path, expression in both.items() if expression is not None)
    yield from ((each.path, each.expression) for each in decision.requirements)
    yield from ((each.path, each.most) for each in decision.limits)
    yield from ((f"faults.{fault.name}.when", fault.when) for fault in decision.faults)
