"""A plan in the making: every change adds its part, each seeing what the ones before it will have done."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from regraft.adaptation_manager.steps.actions import PlannedStep
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.messages.protocol.host import DescribedComponent
from regraft.bus_schema.model.adaptation import Change, Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import State


@dataclass(slots=True)
class Draft:
    """``architecture`` is the one that results so far, ``live`` how the components would then be.

    ``live`` holds only components that answered. ``manager`` is the manager's own name. ``described`` has the
    hosts' description of each component to be added, by the index of its change. ``preparing`` are the steps next to
    the running system: they come before all others. ``unclear`` are the components to be added that cannot be judged.
    ``started_as`` has the incarnation as which each living run was started. ``lost`` are the hosts that count as lost,
    ``absent`` has why the others that are not there are not. ``restarting`` are the components that keep ending.
    ``changes`` are all that are planned, with the indices that they have here.
    """

    architecture: Architecture
    live: dict[str, ComponentView]
    manager: str = ""
    described: dict[int, DescribedComponent] = field(default_factory=dict)
    index: int | None = None
    preparing: list[PlannedStep] = field(default_factory=list)
    steps: list[PlannedStep] = field(default_factory=list)
    added: set[str] = field(default_factory=set)
    removed: set[str] = field(default_factory=set)
    unclear: set[str] = field(default_factory=set)
    started_as: dict[str, int] = field(default_factory=dict)
    swapped: set[str] = field(default_factory=set)
    moved: set[str] = field(default_factory=set)
    violations: list[Violation] = field(default_factory=list)
    lost: frozenset[str] = frozenset()
    absent: dict[str, str] = field(default_factory=dict)
    restarting: frozenset[str] = frozenset()
    changes: Sequence[Change] = ()
    before: dict[str, ComponentSpec] = field(init=False)
    _at_first: dict[str, ComponentView] = field(init=False)

    def __post_init__(self) -> None:
        self.before = dict(self.architecture.components)
        self._at_first = dict(self.live)

    def at_first(self, component: str) -> State | None:
        """Return the state that a component is in before anything is done; None if it did not report one."""
        return self._at_first[component].state if component in self._at_first else None

    def spec(self, component: str) -> ComponentSpec:
        """Return a component's spec as it would be so far."""
        return self.architecture.components[component]

    def update(self, spec: ComponentSpec) -> None:
        """Take over a changed spec."""
        self.architecture = self.architecture.with_component(spec)

    def refuse(self, component: str, where: str, problem: str) -> None:
        """Note a violation of the change being planned."""
        self.violations.append(Violation(self.index, component, where, problem))
