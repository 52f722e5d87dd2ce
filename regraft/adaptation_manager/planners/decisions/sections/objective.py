"""The sections ``qualities``, ``objective`` and ``triggers``: what is wanted, and when to decide."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from regraft.adaptation_manager.planners.decisions.fields import expression, expressions
from regraft.adaptation_manager.planners.decisions.model import DecisionQuality, Requirement, Triggers
from regraft.bus_schema.model.expressions import Expression, Unknown
from regraft.bus_schema.suggestions import no_such
from regraft.stack.yaml.section import Section

MIN_PERIOD = 0.01
SIGNS: Final = {"at_least": ">=", "at_most": "<="}


def read_qualities(document: Section) -> tuple[DecisionQuality, ...]:
    """Return the qualities; one that is given as an expression is measured and estimated by it."""
    table = document.section("qualities")
    found = []
    for name in table.names():
        node = table.node(name)
        if node is not None and not isinstance(node.value, dict):
            both = expression(table, name)
            found.append(DecisionQuality(name, both, both))
            continue
        section = table.section(name)
        section.only("measured", "estimated")
        if not section.names():
            table.wrong(name, "has neither 'measured' nor 'estimated'")
        found.append(DecisionQuality(name, expression(section, "measured"), expression(section, "estimated")))
    return tuple(found)


@dataclass(slots=True)
class ObjectivePart:
    """The content of the section ``objective``."""

    utility: Expression | None
    weights: dict[str, Expression]
    assume: tuple[tuple[str, Expression], ...]
    bounds: tuple[Requirement, ...]
    margin: float
    low: float
    high: float
    settle: float


def read_objective(document: Section, qualities: tuple[DecisionQuality, ...]) -> ObjectivePart:
    """Return the objective."""
    section = document.section("objective")
    section.only("utility", "weights", "assume", "bounds", "margin", "range", "settle")
    if "utility" not in section:
        section.wrong("utility", "is missing: an expression for what a choice is worth")
    low, high = _range(section)
    return ObjectivePart(
        expression(section, "utility"),
        dict(expressions(section.section("weights"))),
        tuple(expressions(section.section("assume"))),
        tuple(_bounds(section.section("bounds"), [quality.name for quality in qualities])),
        section.number("margin", minimum=0.0) or 0.0,
        low,
        high,
        section.number("settle", minimum=0.0, maximum=3600.0) or 0.0,
    )


def _range(section: Section) -> tuple[float, float]:
    node = section.node("range")
    if node is None:
        return 0.0, 1.0
    numbers: list[Any] = [part.value for part in node.value] if isinstance(node.value, tuple) else []
    if len(numbers) == 2 and all(type(each) in (int, float) for each in numbers) and numbers[0] < numbers[1]:
        return float(numbers[0]), float(numbers[1])
    section.wrong("range", "must be [least, greatest] utility, for planners that learn")
    return 0.0, 1.0


def _bounds(section: Section, qualities: list[str]) -> Iterator[Requirement]:
    for name in section.names():
        if name not in qualities:
            section.wrong(name, no_such("quality", name, qualities))
            continue
        bound = section.section(name)
        bound.only("at_least", "at_most")
        limits = {key: expression(bound, key) for key in SIGNS}
        least, most = (_constant(limits[key]) for key in SIGNS)
        if least is not None and most is not None and least > most:
            bound.wrong("at_least", f"{least:g}: must be at most 'at_most', {most:g}")
        if (node := section.node(name)) is not None and node.value == {}:
            section.wrong(name, "has no bound: give 'at_least', 'at_most' or both")
        for key, limit in limits.items():
            if limit is not None:
                sign = SIGNS[key]
                text = f"{name} {sign} ({limit.text})"
                yield Requirement(bound.at(key), f"the bound {text}", Expression(text))


def _constant(limit: Expression | None) -> float | None:
    """Return the number that a limit always is, None if it depends on something."""
    if limit is None or limit.names:
        return None
    try:
        return limit.number({})
    except Unknown:  # it is reported as being no number
        return None


def read_triggers(document: Section) -> Triggers:
    """Return when a planner decides by itself."""
    section = document.section("triggers")
    section.only("every", "on_fault", "on_requirement")
    every = section.number("every", minimum=MIN_PERIOD)
    return Triggers(every, section.flag("on_fault", False), section.distinct("on_requirement"))
