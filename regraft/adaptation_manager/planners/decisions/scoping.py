"""Decisions of one robot among several: its short names mean its own components and topics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from regraft.adaptation_manager.planners.choices.estimates import ClassEstimates, Estimator
from regraft.adaptation_manager.planners.choices.settings import Kind, Setting
from regraft.adaptation_manager.planners.choices.slots import Alternative, Slot
from regraft.adaptation_manager.planners.decisions.model import ContextEntry, Decision
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Unknown
from regraft.bus_schema.model.robots.scoped_changes import Names


def in_scope(decision: Decision, scope: str) -> Decision:
    """Return a decision whose components, topics and requirements have the names that they have in the whole system."""
    if not scope:
        return decision
    names = Names(scope)
    turning = tuple(map(names.component, decision.triggers.on_requirement))
    return replace(
        decision,
        slots=tuple(_slot(slot, names) for slot in decision.slots),
        context=tuple(_entry(entry, names) for entry in decision.context),
        triggers=replace(decision.triggers, on_requirement=turning),
    )


def _slot(slot: Slot, names: Names) -> Slot:
    return replace(slot, alternatives=tuple(_alternative(each, names) for each in slot.alternatives))


def _alternative(alternative: Alternative, names: Names) -> Alternative:
    return replace(
        alternative,
        settings=tuple(_setting(each, names) for each in alternative.settings),
        otherwise=tuple(_setting(each, names) for each in alternative.otherwise),
    )


def _setting(setting: Setting, names: Names) -> Setting:
    value = setting.value
    if setting.kind is Kind.PORT:
        value = names.topic(str(value))
    elif setting.kind is Kind.PRESENCE and isinstance(value, dict):
        value = _added(value, names)
    return replace(setting, component=names.component(setting.component), value=value)


def _added(plain: dict[str, PlainValue], names: Names) -> dict[str, PlainValue]:
    """Return the map that a stack file has of a component; what has no names is left to the check of the decision."""
    return plain | {
        key: {of: names.topic(name) if isinstance(name, str) else name for of, name in given.items()}
        for key, given in plain.items()
        if key in ("connect", "services") and isinstance(given, dict)
    }


def _entry(entry: ContextEntry, names: Names) -> ContextEntry:
    return replace(
        entry,
        topic=names.topic(entry.topic) if entry.topic else "",
        component=names.component(entry.component) if entry.component else "",
        requirement=names.component(entry.requirement) if entry.requirement else "",
    )


def estimates_in(architecture: Architecture, scope: str) -> Estimator:
    """Return the estimates of components by the names that they have in a scope."""
    estimates = ClassEstimates(architecture)
    return ScopedEstimates(estimates, Names(scope)) if scope else estimates


class ScopedEstimates:
    """Estimates of components, asked for by short names."""

    def __init__(self, estimates: Estimator, names: Names) -> None:
        self._estimates = estimates
        self._names = names

    def knows(self, component: str) -> bool:
        """Return whether there is such a component."""
        return bool(component) and self._estimates.knows(self._names.component(component))

    def depends_on(self, component: str, setting: Setting) -> bool:
        """Return whether a component's estimates may be others under a setting."""
        return self._estimates.depends_on(self._names.component(component), setting)

    def estimate(
        self, component: str, settings: Sequence[Setting], context: Mapping[str, PlainValue]
    ) -> Mapping[str, float | Unknown]:
        """Return a component's qualities by name; raises Unknown."""
        return self._estimates.estimate(self._names.component(component), settings, context)
