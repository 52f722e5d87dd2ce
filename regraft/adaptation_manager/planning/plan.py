"""Plans: the steps of an adaptation, and the architectures before and after it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from regraft.adaptation_manager.steps.actions import ApplyParameters, PlannedStep, TakeOver
from regraft.bus_schema.messages.protocol.host import UpdateSpecs
from regraft.bus_schema.model.adaptation import StepReport, StepState, Unreached
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, HostRules


@dataclass(frozen=True)
class Plan:
    """An adaptation's steps; the first ``preparing`` only prepare. Both architectures carry their own revision.

    ``unreached`` are components that it is about, and that do not answer.
    """

    before: Architecture
    after: Architecture
    steps: tuple[PlannedStep, ...] = ()
    preparing: int = 0
    unreached: tuple[Unreached, ...] = ()

    def as_revision(self, revision: int) -> Plan:
        """Return the plan with ``revision`` as that of the architecture after it."""
        if revision == self.after.revision:
            return self
        return replace(self, after=replace(self.after, revision=revision))

    def asking(self, modes: dict[str, str]) -> Plan:
        """Return the plan with ``modes`` as those that are asked for after it, by part."""
        if modes == self.after.asked_modes:
            return self
        return replace(self, after=replace(self.after, asked_modes=modes))

    def with_host_rules(self, rules: dict[str, HostRules]) -> Plan:
        """Return the plan with ``rules`` in both architectures."""
        if rules is self.before.host_rules is self.after.host_rules:
            return self
        before, after = (replace(each, host_rules=rules) for each in (self.before, self.after))
        return replace(self, before=before, after=after)

    @cached_property
    def changes(self) -> UpdateSpecs:
        """Return the changes for readers who know the state before: specs without what that has for the same class."""
        update = way(self.before, self.after)
        return replace(update, specs=tuple(spec.brief(self.before.components.get(spec.name)) for spec in update.specs))

    def way_back(self) -> UpdateSpecs:
        """Return what leads back, for hosts that may or may not know of the changes."""
        return way(self.after, self.before)

    @property
    def removed(self) -> tuple[ComponentSpec, ...]:
        """The components that are not there any more afterwards."""
        gone = sorted(self.before.components.keys() - self.after.components.keys())
        return tuple(self.before.components[name] for name in gone)

    @property
    def succeeded(self) -> tuple[tuple[str, str], ...]:
        """The components of which another run continues, each with the host of the previous run."""
        actions = (step.do for step in self.steps)
        return tuple((action.component, action.host) for action in actions if isinstance(action, TakeOver))

    @property
    def only_gives_values(self) -> bool:
        """Whether all that is done is to set parameters, each step all or nothing."""
        return all(isinstance(step.do, ApplyParameters) for step in self.steps)

    def reports(self) -> list[StepReport]:
        """Return the steps as not yet begun."""
        return [
            StepReport(number, step.component, step.text, StepState.PLANNED)
            for number, step in enumerate(self.steps, start=1)
        ]


def way(start: Architecture, goal: Architecture) -> UpdateSpecs:
    """Return the update that leads from one architecture to another."""
    changed = (spec for name, spec in sorted(goal.components.items()) if start.components.get(name) != spec)
    topics = (topic for name, topic in sorted(goal.topics.items()) if start.topics.get(name) != topic)
    return UpdateSpecs(
        goal.revision,
        tuple(changed),
        tuple(sorted(start.components.keys() - goal.components.keys())),
        topics=tuple(topics),
        removed_topics=tuple(sorted(start.topics.keys() - goal.topics.keys())),
        asked_modes=None if start.asked_modes == goal.asked_modes else goal.asked_modes,
    )
