"""Whether a decision can be taken in a stack, and what of it a planner cannot express."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from regraft.adaptation_manager.planners.choices.estimates import Estimator
from regraft.adaptation_manager.planners.choices.fitting import misfits
from regraft.adaptation_manager.planners.choices.settings import Setting
from regraft.adaptation_manager.planners.decisions.model import Decision
from regraft.adaptation_manager.planners.decisions.reading import expressions_of
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Unknown
from regraft.bus_schema.suggestions import near, no_such
from regraft.stack.yaml.problems import Report

OTHERS: Final = ("total", "qualities")
"""The first parts of names that are no estimates: sums of figures, and requirements."""
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


def check_in(decision: Decision, architecture: Architecture, estimates: Estimator, report: Report) -> None:
    """Note each part of a decision that cannot be in an architecture with these estimates."""
    for misfit in misfits(decision.slots, architecture):
        slot = decision.slots[misfit.slot]
        path = _path(decision, misfit.slot, misfit.alternative, misfit.setting, misfit.part, report)
        report.add(path or f"choices.{slot.name}", misfit.why)
    for entry in decision.context:
        if entry.topic and entry.topic not in architecture.topics:
            report.add(f"context.{entry.name}.topic", no_such("topic", entry.topic, architecture.topics))
        if entry.component and entry.component not in architecture.components:
            report.add(f"context.{entry.name}.fault", no_such("component", entry.component, architecture.components))
    _check_estimates(decision, architecture, estimates, report)


def _path(decision: Decision, slot: int, number: int, setting: Setting, part: str, report: Report) -> str:
    """Return the field that holds a setting's part, empty if it is not found."""
    found = decision.slots[slot]
    choice, kind = f"choices.{found.name}", setting.kind.value
    alternative = found.alternatives[number]
    base = f"{choice}.alternatives.{alternative.name}.set"
    if base in report.locations:
        at = alternative.settings.index(setting)
        base = f"{base}.{at}" if f"{base}.{at}" in report.locations else base
        names = {"component": "component", "member": kind, "value": "value" if kind == "parameter" else kind}
        return f"{base}.{names[part]}"
    names = {"component": "component", "member": kind, "value": f"{VARIED_FIELDS.get(kind, '')}.{number}"}
    return f"{choice}.{names[part]}"


def _check_estimates(decision: Decision, architecture: Architecture, estimates: Estimator, report: Report) -> None:
    """Note expressions over estimates that there are not, as far as classes estimate without settings and context."""
    known = _names_of(decision)
    for path, expression in expressions_of(decision):
        for name in expression.names:
            owner, _, quality = name.rpartition(".")
            if not owner or name in known or owner.split(".")[0] in OTHERS or path.endswith(".measured"):
                continue
            if not estimates.knows(owner):
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


def not_predicted(decision: Decision) -> Iterator[Inexpressible]:
    """Yield what a planner cannot express that takes what is expected to be best."""
    for quality in decision.qualities:
        if quality.estimated is None:
            yield Inexpressible(f"qualities.{quality.name}", "is only measured, so it cannot be expected")
    if decision.settle:
        yield Inexpressible("objective.settle", "it measures no effect")
    if (decision.low, decision.high) != (0.0, 1.0):
        yield Inexpressible("objective.range", "it learns nothing, so utility may have any range")
