"""Reads a decision file; anything wrong with it is a StackError with file, line and field."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from regraft.adaptation_manager.planners.choices.objective import TOTAL
from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.adaptation_manager.planners.decisions.kinds import check_kinds
from regraft.adaptation_manager.planners.decisions.model import NO_COMPONENTS, Decision, expressions_of
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
from regraft.bus_schema.suggestions import instead_of, near, no_such
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
    context, choices = read_context(section), read_choices(section)
    qualities = read_qualities(section)
    objective = read_objective(section, qualities)
    constraints = read_constraints(section, choices)
    decision = Decision(
        name=file.stem,
        file=str(file),
        context=context,
        slots=choices.slots,
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
        faults=read_faults(section, choices),
        triggers=read_triggers(section),
    )
    given = {name for part in ("context", "choices") for name in section.section(part).names()}
    _check_unique(section, report)
    _check_names(decision, given, section.section("objective"), report)
    _check_figures(decision, report, complete=choices.right)
    check_kinds(decision, report)
    report.raise_if_any()
    return decision


def _check_names(decision: Decision, given: set[str], objective: Section, report: Report) -> None:
    """Note each name without dots that is not defined; names with dots may be estimates of components.

    ``given`` are the names of context and choices, also of those that are wrong, as may be those of ``objective``.
    """
    choices = {name for slot in decision.slots for name in _names_of(slot)}
    weights, assumed = ({*objective.section(part).names()} for part in ("weights", "assume"))
    world = given - choices | weights
    qualities = {quality.name for quality in decision.qualities}
    limits = {limit.path for limit in decision.limits}
    for path, expression in expressions_of(decision):
        is_first = path.startswith("faults.") or path in limits
        # Faults and limits are computed before anything is chosen.
        known = world if is_first else world | choices | assumed
        if path.startswith("objective.weights."):
            known = known - weights
        elif not is_first and not path.startswith(("qualities.", "objective.assume.")):
            known |= qualities
        for name in expression.names:
            of_choice = name in choices or name.startswith(f"{TOTAL}.")
            if name not in known and ("." not in name or (is_first and of_choice)):
                report.add(path, f"nothing is called {name!r} here; {instead_of(name, known)}")
    _check_assumptions(decision, choices, report)
    _check_faults_and_limits(decision, choices, report)
    _check_triggers(decision, report)


def _check_assumptions(decision: Decision, choices: set[str], report: Report) -> None:
    """Note estimates in assumptions, also those that they speak of by weights; ``choices`` are no estimates."""
    for name, expression in decision.assume:
        for each in _estimates_in(expression, decision, choices):
            why = f"{each} is an estimate, and estimates are worked out from what is assumed"
            report.add(f"objective.assume.{name}", why)


def _check_faults_and_limits(decision: Decision, choices: set[str], report: Report) -> None:
    """Note estimates in conditions of faults and in limits: nothing is chosen yet of which they could be."""
    first = [(limit.path, limit.most) for limit in decision.limits]
    first += [(f"faults.{fault.name}.when", fault.when) for fault in decision.faults]
    for path, expression in first:
        for each in _estimates_in(expression, decision, choices):
            report.add(path, f"{each} is an estimate, and nothing is chosen yet that it could be of")


def _estimates_in(expression: Expression, decision: Decision, choices: set[str]) -> Iterator[str]:
    """Yield the estimates of which an expression speaks, also by weights; ``choices`` are none."""
    weights = [decision.weights[each] for each in expression.names if each in decision.weights]
    for each in dict.fromkeys(each for part in (expression, *weights) for each in part.names):
        owner, _, _ = each.rpartition(".")
        is_misspelt = owner in choices and near(each, choices) is not None
        if owner and each not in choices and each.split(".")[0] not in NO_COMPONENTS and not is_misspelt:
            yield each


def _check_figures(decision: Decision, report: Report, *, complete: bool) -> None:
    """Note names of figures that no alternative has. Not all figures are known where a choice is not ``complete``."""
    of_slots = {slot.name: {name for each in slot.alternatives for name in each.figures} for slot in decision.slots}
    every = set().union(*of_slots.values())
    for path, expression in expressions_of(decision):
        for name in expression.names:
            owner, _, figure = name.rpartition(".")
            if owner == TOTAL and figure not in every and complete:
                report.add(path, f"{name}: {no_such('figure', figure, every)}")
            # A component may have the name of a choice, so only what is near is a mistake for certain.
            meant = near(figure, of_slots.get(owner, ()))
            if meant is not None and figure not in of_slots[owner]:
                report.add(path, f"{name}: {owner} has no figure {figure!r}; did you mean {meant!r}?")


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


def _check_triggers(decision: Decision, report: Report) -> None:
    requirements = {entry.requirement for entry in decision.context if entry.requirement}
    for index, name in enumerate(decision.triggers.on_requirement):
        if name not in requirements:
            path = f"triggers.on_requirement.{index}"
            report.add(path, f"{name!r} is no requirement of the context; {instead_of(name, requirements)}")
    if decision.triggers.on_fault and not decision.faults:
        report.add("triggers.on_fault", "there are no faults: name some, or leave this out")
