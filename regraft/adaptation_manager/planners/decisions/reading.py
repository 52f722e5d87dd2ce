"""Reads a decision file; anything wrong with it is a StackError with file, line and field."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.adaptation_manager.planners.decisions.model import Decision, Requirement
from regraft.adaptation_manager.planners.decisions.sections.choices import read_choices
from regraft.adaptation_manager.planners.decisions.sections.constraints import read_constraints
from regraft.adaptation_manager.planners.decisions.sections.context import NAME, read_context
from regraft.adaptation_manager.planners.decisions.sections.faults import read_faults
from regraft.adaptation_manager.planners.decisions.sections.objective import (
    read_objective,
    read_qualities,
    read_triggers,
)
from regraft.bus_schema.model.expressions import Expression
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.yaml.document import read_map
from regraft.stack.yaml.nodes import locations_of
from regraft.stack.yaml.problems import Report, fail
from regraft.stack.yaml.section import Section

SECTIONS: Final = ("context", "choices", "constraints", "qualities", "objective", "faults", "triggers")


def locations_in(file: Path) -> Report:
    """Return a report that knows the lines of a file's fields; raises StackError."""
    return Report(str(file), locations_of(read_map(file)))


def read_decision(file: Path) -> Decision:
    """Return the decision that a file describes; its name is the file's. Raises StackError with all that is wrong."""
    if not NAME.fullmatch(file.stem):
        fail(str(file), None, f"a decision is called like its file: {file.stem!r} must be letters, digits and '_'")
    document = read_map(file, f"fields such as {', '.join(SECTIONS[:2])}")
    report = Report(str(file), locations_of(document))
    section = Section(document, "", report)
    section.only(*SECTIONS)
    context, slots = read_context(section), read_choices(section)
    qualities = read_qualities(section)
    objective = read_objective(section, qualities)
    constraints = read_constraints(section, slots)
    decision = Decision(
        name=file.stem,
        file=str(file),
        context=context,
        slots=slots,
        utility=objective.utility or Expression("0"),
        rules=tuple(constraints.rules),
        requirements=(*constraints.requirements, *objective.bounds),
        limits=tuple(constraints.limits),
        qualities=qualities,
        weights=objective.weights,
        assume=objective.assume,
        margin=objective.margin,
        low=objective.low,
        high=objective.high,
        settle=objective.settle,
        faults=read_faults(section, slots),
        triggers=read_triggers(section),
    )
    given = {name for part in ("context", "choices") for name in section.section(part).names()}
    _check_unique(section, report)
    _check_names(decision, given, report)
    report.raise_if_any()
    return decision


def _check_names(decision: Decision, given: set[str], report: Report) -> None:
    """Note each name without dots that is not defined; names with dots may be estimates of components.

    ``given`` are the names of context and choices, also of those that are wrong.
    """
    choices = {name for slot in decision.slots for name in _names_of(slot)}
    world = given | decision.weights.keys()
    qualities = {quality.name for quality in decision.qualities}
    assumed = [name for name, _ in decision.assume]
    for path, expression in expressions_of(decision):
        known = world | choices | {*assumed}
        if path.startswith("objective.weights."):
            known = known - decision.weights.keys()
        elif not path.startswith(("qualities.", "faults.", "objective.assume.")):
            known |= qualities
        for name in expression.names:
            if "." not in name and name not in known:
                report.add(path, f"nothing is called {name!r} here; {instead_of(name, known)}")
    _check_triggers(decision, report)


def _check_unique(document: Section, report: Report) -> None:
    """Note each name that is defined twice; an assumption may have the name of an entry of the context."""
    seen: dict[str, str] = {}
    weights = document.section("objective").section("weights")
    for section in (document.section("context"), document.section("choices"), document.section("qualities"), weights):
        for name in section.names():
            if name in seen:
                report.add(section.at(name), f"{name!r} is the name of {seen[name]} already: take another")
            seen.setdefault(name, section.at(name))


def _names_of(slot: Slot) -> Iterator[str]:
    yield slot.name
    for alternative in slot.alternatives:
        yield from (f"{slot.name}.{figure}" for figure in alternative.figures)


def expressions_of(decision: Decision) -> Iterator[tuple[str, Expression]]:
    """Yield all expressions of a decision, each with its field."""
    yield "objective.utility", decision.utility
    yield from ((f"objective.weights.{name}", each) for name, each in decision.weights.items())
    yield from ((f"objective.assume.{name}", each) for name, each in decision.assume)
    for quality in decision.qualities:
        for how, expression in (("measured", quality.measured), ("estimated", quality.estimated)):
            if expression is not None:
                yield f"qualities.{quality.name}.{how}", expression
    constraints: Iterable[Requirement] = decision.requirements
    yield from ((each.path, each.expression) for each in constraints)
    yield from ((each.path, each.most) for each in decision.limits)
    yield from ((f"faults.{fault.name}.when", fault.when) for fault in decision.faults)


def _check_triggers(decision: Decision, report: Report) -> None:
    requirements = {entry.requirement for entry in decision.context if entry.requirement}
    for index, name in enumerate(decision.triggers.on_requirement):
        if name not in requirements:
            path = f"triggers.on_requirement.{index}"
            report.add(path, f"{name!r} is no requirement of the context; {instead_of(name, requirements)}")
    if decision.triggers.on_fault and not decision.faults:
        report.add("triggers.on_fault", "there are no faults: name some, or leave this out")
