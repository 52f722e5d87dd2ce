"""Whether a decision can be taken in a stack, and what of it a planner cannot express."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from regraft.adaptation_manager.planners.choices.estimates import Estimator
from regraft.adaptation_manager.planners.choices.fitting import misfits
from regraft.adaptation_manager.planners.choices.settings import Kind, Setting
from regraft.adaptation_manager.planners.decisions.kinds import check_kinds
from regraft.adaptation_manager.planners.decisions.model import (
    NO_COMPONENTS,
    ContextEntry,
    Decision,
    expressions_of,
)
from regraft.bus_schema.encoding.reading import Reading
from regraft.bus_schema.encoding.reading_checks import ValueKind, reading_kind, reading_problem, reading_texts
from regraft.bus_schema.encoding.registry import type_named
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Unknown
from regraft.bus_schema.model.robots.scoped_changes import Names
from regraft.bus_schema.model.system_topics import SYSTEM_TOPICS
from regraft.bus_schema.suggestions import instead_of, near, no_such
from regraft.process.main import NoSuchClass
from regraft.stack.classes import describe_class
from regraft.stack.sections.hosts import FIRST
from regraft.stack.yaml.problems import Report

PLACEHOLDER: Final = 0.5
"""The value of assumptions for which a class is asked what it estimates at all."""
VARIED_FIELDS: Final = {
    "parameter": "values",
    "port": "topics",
    "state": "states",
    "transition": "transitions",
    "class": "classes",
    "host": "hosts",
}


def check_in(
    decision: Decision, architecture: Architecture, estimates: Estimator, report: Report, scope: str = ""
) -> None:
    """Note each part of a decision that cannot be in an architecture with these estimates."""
    for misfit in misfits(decision.slots, architecture):
        slot = decision.slots[misfit.slot]
        path = _path(decision, misfit.slot, misfit.alternative, misfit.setting, misfit.part, report)
        report.add(path or f"choices.{slot.name}", misfit.why)
    _check_classes(decision, architecture, report)
    read: dict[str, ValueKind | None] = {}
    texts: dict[str, tuple[str, ...]] = {}
    for entry in decision.context:
        if entry.reading is not None:
            read[entry.name], texts[entry.name] = _read(entry, entry.reading, architecture, report)
        if entry.component and entry.component not in architecture.components:
            report.add(f"context.{entry.name}.fault", no_such("component", entry.component, architecture.components))
    check_kinds(decision, report, read, {name: known for name, known in texts.items() if known})
    _check_estimates(decision, architecture, estimates, report)
    _check_measured(decision, architecture, Names(scope), report)


def _read(
    entry: ContextEntry, reading: Reading, architecture: Architecture, report: Report
) -> tuple[ValueKind | None, tuple[str, ...]]:
    """Return the kind of value that is read from a topic, and all texts that it may be. Both may be unknown.

    A field that cannot be read is noted.
    """
    topics = {name: topic.type for name, topic in architecture.topics.items()}
    if entry.topic not in topics and entry.topic not in SYSTEM_TOPICS:
        report.add(f"context.{entry.name}.topic", no_such("topic", entry.topic, topics))
        return None, ()
    message = type_named((topics | SYSTEM_TOPICS)[entry.topic])
    problem = reading_problem(message.shape, reading)
    kind = None if problem else reading_kind(message.shape, reading)
    if kind is ValueKind.LIST:
        problem = f"{message.cls.__name__}.{reading.field} is a list, which no expression has: give 'reduce'"
    if problem:
        report.add(f"context.{entry.name}.field", problem)
        return None, ()
    return kind, reading_texts(message.shape, reading)


def _check_classes(decision: Decision, architecture: Architecture, report: Report) -> None:
    """Note classes that there are not, of components of this machine: other hosts have classes of their own."""
    for slot, alternative, setting in _settings(decision):
        spec = architecture.components.get(setting.component)
        if setting.kind is Kind.CLASS and spec is not None and spec.host == FIRST:
            try:
                describe_class(str(setting.value), {})
            except NoSuchClass as error:
                path = _path(decision, slot, alternative, setting, "value", report)
                report.add(path, str(error))


def _settings(decision: Decision) -> Iterator[tuple[int, int, Setting]]:
    """Yield all settings, with the indices of their slots and alternatives."""
    for index, slot in enumerate(decision.slots):
        for number, alternative in enumerate(slot.alternatives):
            yield from ((index, number, setting) for setting in alternative.every_setting)


def _path(decision: Decision, slot: int, number: int, setting: Setting, part: str, report: Report) -> str:
    """Return the field that holds a setting's part, empty if it is not found."""
    found = decision.slots[slot]
    choice, kind = f"choices.{found.name}", setting.kind.value
    alternative = found.alternatives[number]
    is_chosen = setting in alternative.settings
    base = f"{choice}.alternatives.{alternative.name}.{'set' if is_chosen else 'otherwise'}"
    if base in report.locations:
        at = (alternative.settings if is_chosen else alternative.otherwise).index(setting)
        base = f"{base}.{at}" if f"{base}.{at}" in report.locations else base
        names = {"component": "component", "member": kind, "value": "value" if kind == "parameter" else kind}
        return f"{base}.{names[part]}"
    names = {"component": "component", "member": kind, "value": f"{VARIED_FIELDS.get(kind, '')}.{number}"}
    return f"{choice}.{names[part]}"


def _check_estimates(decision: Decision, architecture: Architecture, estimates: Estimator, report: Report) -> None:
    """Note expressions over estimates that there are not, as far as classes estimate without settings and context."""
    known = _names_of(decision)
    figures = {slot.name: {f for each in slot.alternatives for f in each.figures} for slot in decision.slots}
    for path, expression in expressions_of(decision):
        for name in expression.names:
            owner, _, quality = name.rpartition(".")
            if not owner or name in known or owner.split(".")[0] in NO_COMPONENTS or path.endswith(".measured"):
                continue
            if owner in figures and not estimates.knows(owner):
                report.add(path, f"{name}: {no_such('figure', quality, figures[owner])}")
            elif not estimates.knows(owner):
                report.add(path, f"{name}: {no_such('component', owner, architecture.components)}")
            else:
                _check_quality(owner, quality, path, decision, estimates, report)


def _check_quality(
    component: str, quality: str, path: str, decision: Decision, estimates: Estimator, report: Report
) -> None:
    """Note a quality that is misspelt: some are only estimated with certain parameters or context."""
    try:
        found = estimates.estimate(component, (), {name: PLACEHOLDER for name, _ in decision.assume})
    except Unknown:
        return
    meant = near(quality, found)
    if quality not in found and meant is not None:
        report.add(path, f"{component} estimates no {quality!r}; did you mean {meant!r}?")


def _check_measured(decision: Decision, architecture: Architecture, names: Names, report: Report) -> None:
    """Note what no component measures. One expression for both may speak of what is only estimated."""
    for quality in decision.qualities:
        if quality.measured is quality.estimated:
            continue
        for name in decision.measured_names(quality):
            component, _, measured = name.rpartition(".")
            why = not_measured(architecture, names.component(component), measured)
            if why:
                report.add(f"qualities.{quality.name}.measured", f"{name}: {why}")


def not_measured(architecture: Architecture, component: str, quality: str) -> str:
    """Return why a component measures no such quality, empty if it does."""
    spec = architecture.components.get(component)
    if spec is None:
        return no_such("component", component, architecture.components)
    described = spec.description
    if described is None or not spec.managed:
        return f"{component} is unmanaged: it measures nothing"
    found = described.quality(quality)
    if found is not None and not found.measured:
        return f"{component} only estimates {quality!r}"
    if found is None:
        return f"{component} measures no {quality!r}; " + instead_of(
            quality, [each.name for each in described.qualities if each.measured]
        )
    return "" if described.evaluate_every is not None else f"{component} measures nothing: its evaluate_every is None"


def _names_of(decision: Decision) -> set[str]:
    """Return the names with dots that are no estimates: choices, and their figures."""
    names = {slot.name for slot in decision.slots}
    return names | {
        f"{slot.name}.{figure}" for slot in decision.slots for a in slot.alternatives for figure in a.figures
    }


@dataclass(frozen=True, slots=True)
class Inexpressible:
    """A part of a decision that a kind of planner does not use, and why."""

    field: str
    why: str


def not_learned(decision: Decision) -> Iterator[Inexpressible]:
    """Yield what a planner cannot express that learns from the measured utility."""
    if any(quality.estimated is not None for quality in decision.qualities):
        yield Inexpressible("qualities", "estimates only serve the bounds: it learns what options are worth")
    if decision.margin:
        yield Inexpressible("objective.margin", "it tries what may be better, by whatever margin")
    for name in decision.utility.names:
        quality = next((each for each in decision.qualities if each.name == name), None)
        if quality is not None and quality.measured is None:
            yield Inexpressible(f"qualities.{name}", "is not measured, so the utility that was earned is not known")
        elif quality is None and _is_estimate(name, decision):
            why = f"{name} is an estimate, so the utility that was earned is not known: measure it as a quality"
            yield Inexpressible("objective.utility", why)
    yield from _only_measured_bounds(decision)


def _is_estimate(name: str, decision: Decision) -> bool:
    owner, _, _ = name.rpartition(".")
    return bool(owner) and name not in _names_of(decision) and owner.split(".")[0] not in NO_COMPONENTS


def _only_measured_bounds(decision: Decision) -> Iterator[Inexpressible]:
    """Yield the bounds of qualities without an estimate: nothing but what stands can keep them."""
    bound = {name for requirement in decision.requirements for name in requirement.expression.names}
    for quality in decision.qualities:
        if quality.name in bound and quality.estimated is None:
            why = "is only measured, so only what stands can keep its bounds"
            yield Inexpressible(f"qualities.{quality.name}", why)


def not_predicted(decision: Decision) -> Iterator[Inexpressible]:
    """Yield what a planner cannot express that takes what is expected to be best."""
    for quality in decision.qualities:
        if quality.estimated is None:
            yield Inexpressible(f"qualities.{quality.name}", "is only measured, so it cannot be expected")
    if decision.settle and not decision.measured_names():
        yield Inexpressible("objective.settle", "it measures no effect")
    if (decision.low, decision.high) != (0.0, 1.0):
        yield Inexpressible("objective.range", "it learns nothing, so utility may have any range")
