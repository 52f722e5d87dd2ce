"""A plan in the making: every change adds its part, each seeing what the ones before it will have done."""

from __future__ import annotations

from dataclasses import dataclass, field

from adaptation_manager.steps.actions import PlannedStep
from bus_schema.adaptation import Violation
from bus_schema.architecture import Architecture, ComponentSpec
from bus_schema.messages.control import ComponentView


@dataclass(slots=True)
class Draft:
    """``architecture`` is the one that results so far, ``live`` how the components would then be.

    ``live`` holds only components that answered. ``manager`` is the manager's own name.
    """

    architecture: Architecture
    live: dict[str, ComponentView]
    manager: str = ""
    index: int | None = None
    steps: list[PlannedStep] = field(default_factory=list)
    violations: list[Violation] = field(default_factory=list)

    def spec(self, component: str) -> ComponentSpec:
        """Return a component's spec as it would be so far."""
        return self.architecture.components[component]

    def update(self, spec: ComponentSpec) -> None:
        """Take over a changed spec."""
        self.architecture = self.architecture.with_component(spec)

    def refuse(self, component: str, where: str, problem: str) -> None:
        """Note a violation of the change being planned."""
        self.violations.append(Violation(self.index, component, where, problem))
