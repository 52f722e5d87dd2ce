"""Plans: the steps of an adaptation, and the architectures before and after it."""

from __future__ import annotations

from dataclasses import dataclass

from adaptation_manager.steps.actions import GiveValues, PlannedStep
from bus_schema.adaptation import StepReport, StepState
from bus_schema.architecture import Architecture, ComponentSpec


@dataclass(frozen=True, slots=True)
class Plan:
    """What is to be done. Both architectures carry their own revision."""

    before: Architecture
    after: Architecture
    steps: tuple[PlannedStep, ...] = ()

    def changed(self, architecture: Architecture) -> tuple[ComponentSpec, ...]:
        """Return the specs that the plan changes, as ``architecture`` (before or after) has them."""
        return tuple(
            architecture.components[name]
            for name in sorted(self.after.components)
            if self.before.components.get(name) != self.after.components[name] and name in architecture.components
        )

    def changes(self) -> tuple[ComponentSpec, ...]:
        """Return the changed specs for those who know the ones before: without what these say of the same class."""
        return tuple(spec.brief(self.before.components.get(spec.name)) for spec in self.changed(self.after))

    @property
    def only_gives_values(self) -> bool:
        """Whether all that is done is to set parameters, each step all or nothing."""
        return all(isinstance(step.do, GiveValues) for step in self.steps)

    def reports(self) -> list[StepReport]:
        """Return the steps as not yet begun."""
        return [
            StepReport(number, step.component, step.text, StepState.PLANNED)
            for number, step in enumerate(self.steps, start=1)
        ]
