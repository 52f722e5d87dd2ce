"""The situation of one cycle: what is required, what is grounded, and what was observed; and its facts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge import vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import (
    REQUIRED,
    Design,
    Grounding,
    Model,
    Objective,
    is_number,
)
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Fact, local_name, number, text, truth
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus, Status

MAX_NESTING: Final = 20
"""Objectives that require each other in turn: beyond it, a requirement counts as circular."""


@dataclass(frozen=True, slots=True)
class Situation:
    """The state of affairs at the time of one cycle.

    ``objectives`` are those that clients gave; objectives that their designs require are added. ``components`` has
    those whose status is known. ``measurements`` has the measured qualities of each grounding: one that is missing is
    unknown, and no violation. ``errors`` has what groundings reported of themselves.
    """

    objectives: tuple[Objective, ...] = ()
    groundings: tuple[Grounding, ...] = ()
    components: Mapping[str, ComponentStatus] = field(default_factory=dict)
    measurements: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    errors: Mapping[str, Status] = field(default_factory=dict)
    context: str = vocabulary.DEFAULT_CONTEXT

    def grounding_of(self, objective: str) -> Grounding | None:
        """Return what solves an objective now."""
        return next((each for each in self.groundings if each.objective == objective), None)


def required_objectives(objective: Objective, design: Design) -> tuple[Objective, ...]:
    """Return the objectives that a design needs when it solves an objective; each has a name of its own."""
    return tuple(
        replace(each, name=f"{objective.name}{REQUIRED}{local_name(each.name)}", priority=objective.priority)
        for each in design.requires
    )


def active_objectives(model: Model, situation: Situation) -> dict[str, Objective]:
    """Return the given objectives, and those that their groundings require in turn, by name."""
    found: dict[str, Objective] = {}
    waiting = [(objective, 0) for objective in situation.objectives]
    while waiting:
        objective, depth = waiting.pop(0)
        found[objective.name] = objective
        grounding = situation.grounding_of(objective.name)
        design = model.designs.get(grounding.design) if grounding is not None else None
        if design is not None and depth < MAX_NESTING:
            waiting += [(each, depth + 1) for each in required_objectives(objective, design)]
    return found


def facts_of(model: Model, situation: Situation) -> Iterator[Fact]:
    """Yield the facts of a situation; those of the files are not among them."""
    for component, status in situation.components.items():
        yield (vocabulary.C_STATUS, component, text(status))
    objectives = active_objectives(model, situation)
    for objective in objectives.values():
        yield from _objective_facts(objective)
    for grounding in situation.groundings:
        yield from _grounding_facts(grounding, situation)
        solved = objectives.get(grounding.objective)
        design = model.designs.get(grounding.design)
        if solved is not None and design is not None:
            for required in required_objectives(solved, design):
                if required.name in objectives:
                    yield (vocabulary.REQUIRES_O, grounding.name, required.name)


def _objective_facts(objective: Objective) -> Iterator[Fact]:
    yield (vocabulary.OBJECTIVE, objective.name)
    yield (vocabulary.TYPE_F, objective.name, objective.function)
    if objective.always_improve:
        yield (vocabulary.ALWAYS_IMPROVE, objective.name, truth(True))
    for index, requirement in enumerate(objective.requirements):
        if not is_number(requirement.bound):
            continue  # the plan refuses such an objective
        value = f"{objective.name}/requirement_{index}"
        yield (vocabulary.HAS_NFR, objective.name, value)
        yield (vocabulary.IS_QUALITY_TYPE, value, requirement.quality)
        yield (vocabulary.HAS_VALUE, value, number(requirement.bound))


def _grounding_facts(grounding: Grounding, situation: Situation) -> Iterator[Fact]:
    yield (vocabulary.GROUNDING, grounding.name)
    yield (vocabulary.TYPE_FD, grounding.name, grounding.design)
    yield (vocabulary.SOLVES_O, grounding.name, grounding.objective)
    error = situation.errors.get(grounding.name)
    if error is not None:
        yield (vocabulary.FG_ERROR, grounding.name, text(error))
    for quality, measured in situation.measurements.get(grounding.name, {}).items():
        if not is_number(measured):
            continue  # a sensor may report that it has no number: the quality is unknown
        # Each grounding has a measurement of its own: the published reasoner had one for the whole system.
        value = f"{grounding.name}/observed_{local_name(quality)}"
        yield (vocabulary.HAS_MEASUREMENT, grounding.name, value)
        yield (vocabulary.IS_QUALITY_TYPE, value, quality)
        yield (vocabulary.HAS_VALUE, value, number(measured))
