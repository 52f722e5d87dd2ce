"""The monitor step: the status of components, measured qualities, errors of groundings, and the context."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, Final

from regraft.adaptation_manager.planners.metacontrol.control.measurements import EVERY, Measurements
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Model, is_of
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus
from regraft.adaptation_manager.planners.metacontrol.knowledge.vocabulary import DEFAULT_CONTEXT
from regraft.adaptation_manager.planners.metacontrol.skills.checks.in_stack import component_in_stack
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.health import Diagnostic, Level
from regraft.bus_schema.messages.management.objectives import (
    BINDING_ERROR,
    COMPONENT_STATUS,
    CONTEXT_STATUS,
    QUALITY_STATUS,
)
from regraft.bus_schema.messages.management.system import (
    SystemFault,
    SystemFaultKind,
    SystemFaults,
    SystemStates,
)
from regraft.bus_schema.model.robots.scopes import component_in_scope
from regraft.bus_schema.suggestions import no_such

EARLY: Final = 1.0
"""Seconds by which the clock of who measures may be ahead."""
RECOVERED: Final = "RECOVERED"
COMPONENT_WORDS: Final = {"FALSE": True, "TRUE": False, RECOVERED: False}
"""Values of a component's status, and whether it has failed then."""


class Implausible(ValueError):
    """A diagnostic that is not taken; the text is why."""


class Monitor:
    """The latest observations. Components and qualities go by the names of the knowledge base."""

    def __init__(
        self, model: Model, scope: str, contexts: Sequence[str], memory: Mapping[str, Any] | None = None
    ) -> None:
        """Begin, or continue from what ``remembered`` returned. ``contexts`` are those that there are."""
        known = memory or {}
        self._model = model
        self._short = {local_name(name): name for name in model.components}
        named = {component_in_stack(short): name for short, name in self._short.items()} | self._short
        self._components = {component_in_scope(scope, short): name for short, name in named.items()}
        self._observed = named | self._components
        self._qualities = {local_name(name): name for name in model.qualities}
        self.contexts = tuple(contexts)
        context = known.get("context", DEFAULT_CONTEXT)
        self.context = context if context in self.contexts else DEFAULT_CONTEXT
        self._published: str = known.get("published", "")  # an earlier version has none
        self.measurements = Measurements(known.get("measurements"))
        self._gone: set[str] = set(known.get("gone", ()))
        self._removed: set[str] = set(known.get("removed", ()))
        self._faulty: set[str] = set(known.get("faulty", ()))
        self._present: tuple[SystemFault, ...] = ()
        self._over: dict[str, float] = dict(known.get("over", {}))
        self._reported: set[str] = {name for name in known.get("reported", ()) if name in model.components}
        self._seen_failed: set[str] = {name for name in known.get("failed", ()) if name in model.components}
        self._recovered: set[str] = {name for name in known.get("recovered", ()) if name in model.components}
        self._just_recovered: set[str] = {n for n in known.get("just_recovered", ()) if n in model.components}
        self._seen_down: set[str] = set(known.get("down", ()))
        self._back: set[str] = set(known.get("back", ()))
        self._errors: dict[str, float] = dict(known.get("errors", {}))

    def remembered(self) -> dict[str, PlainValue]:
        """Return what a further run has to know, as plain data."""
        return {
            "context": self.context,
            "published": self._published,
            "measurements": self.measurements.remembered(),
            "gone": sorted(self._gone),
            "removed": sorted(self._removed),
            "faulty": sorted(self._faulty),
            "over": dict(self._over),
            "reported": sorted(self._reported),
            "failed": sorted(self._seen_failed),
            "recovered": sorted(self._recovered),
            "just_recovered": sorted(self._just_recovered),
            "down": sorted(self._seen_down),
            "back": sorted(self._back),
            "errors": dict(self._errors),
        }

    # --- what is seen ---

    def see(self, states: SystemStates | None, faults: SystemFaults | None) -> None:
        """Take the states of all components, and the faults that are not over; None leaves what is known."""
        if states is not None:
            self._gone = {each.component for each in states.components if each.state is None}
        if faults is not None:
            self._present = faults.present
            self._judge_faults()
        self._note_recoveries()

    def _judge_faults(self) -> None:
        """Find who has a fault; one that an observer holds for over counts no more, until the next."""
        known = {(each.component, each.stamp) for each in self._present}
        self._over = {component: stamp for component, stamp in self._over.items() if (component, stamp) in known}
        ends = (SystemFaultKind.RAISED, SystemFaultKind.RECOVERED)
        self._faulty = {
            each.component
            for each in self._present
            if each.kind not in ends and self._over.get(each.component) != each.stamp
        }

    def individuals(self, components: Iterable[str]) -> frozenset[str]:
        """Return the components of the knowledge base among those of the system, which go by their full names."""
        return frozenset(self._components[name] for name in components if name in self._components)

    def see_removed(self, components: Collection[str]) -> None:
        """Take the components that were removed from the stack: as long as they are, they have failed."""
        self._removed = set(components)
        self._note_recoveries()

    def take(self, diagnostic: Diagnostic, now: float, objectives: Collection[str]) -> None:
        """Take a diagnostic as MROS2's observers publish them; raises Implausible. Others are left alone."""
        if diagnostic.text not in (COMPONENT_STATUS, QUALITY_STATUS, BINDING_ERROR, CONTEXT_STATUS):
            return
        if not math.isfinite(diagnostic.stamp) or diagnostic.stamp > now + EARLY:
            raise Implausible(f"its time is {diagnostic.stamp:.3f} s, must not be after now, {now:.3f} s")
        if diagnostic.text == BINDING_ERROR:
            self._take_error(diagnostic, objectives)
            return
        if len(diagnostic.values) != 1:
            raise Implausible(f"has {len(diagnostic.values)} values, must have 1")
        ((key, value),) = diagnostic.values.items()
        if diagnostic.text == COMPONENT_STATUS:
            self._take_component(key, value)
        elif diagnostic.text == CONTEXT_STATUS:
            self._take_context(str(value))
        else:
            self._take_quality(diagnostic, key, value, objectives)

    def set_context(self, context: str) -> None:
        """Set the context in which designs are chosen; raises Implausible for an unknown one."""
        if context not in self.contexts:
            raise Implausible(no_such("context", context, self.contexts))
        self.context = context

    def _take_context(self, context: str) -> None:
        """Take a published context; one that is repeated is no news, as a client may have set another since."""
        if context != self._published:
            self.set_context(context)
            self._published = context

    def _take_component(self, key: str, value: PlainValue) -> None:
        name = self._observed.get(key)
        if name is None:
            raise Implausible(no_such("component", key, self._short))
        word = str(value).upper()
        if word not in COMPONENT_WORDS:
            raise Implausible(f"the status of {key!r} is {value!r}, must be one of {', '.join(COMPONENT_WORDS)}")
        if COMPONENT_WORDS[word]:
            self._reported.add(name)
        else:
            self._reported.discard(name)
        if word == RECOVERED:
            self._take_recovery(name)
        self._note_recoveries()

    def _take_recovery(self, name: str) -> None:
        """Hold a failure for over that a component has reported of itself: whether it is, a further attempt shows."""
        for fault in self._present:
            if fault.kind is SystemFaultKind.FAILED and self._components.get(fault.component) == name:
                self._over[fault.component] = fault.stamp
        self._judge_faults()

    def _take_quality(self, diagnostic: Diagnostic, key: str, value: PlainValue, objectives: Collection[str]) -> None:
        name = self._qualities.get(key)
        if name is None:
            raise Implausible(no_such("quality", key, self._qualities))
        if diagnostic.subject and diagnostic.subject not in objectives:
            raise Implausible(no_such("objective", diagnostic.subject, objectives))
        number = _number(value)
        quality = self._model.qualities[name]
        if number is None or not quality.lowest <= number <= quality.highest:
            bounds = f"from {quality.lowest:g} to {quality.highest:g}"
            raise Implausible(f"{key} is {value!r}, must be a number {bounds}")
        self.measurements.take(diagnostic.subject or EVERY, name, number, diagnostic.stamp)

    def _take_error(self, diagnostic: Diagnostic, objectives: Collection[str]) -> None:
        if diagnostic.subject not in objectives:
            raise Implausible(no_such("objective", diagnostic.subject, objectives))
        if diagnostic.level is Level.ERROR:
            self._errors[diagnostic.subject] = diagnostic.stamp
        elif diagnostic.level is Level.OK:
            self._errors.pop(diagnostic.subject, None)

    # --- what follows ---

    @property
    def failed(self) -> frozenset[str]:
        """The components of the knowledge base that have failed, by any source."""
        return self.individuals(self.down) | self._reported

    @property
    def down(self) -> frozenset[str]:
        """The components of the system that have failed, were removed or have no run, by their full names."""
        return frozenset(self._gone | self._removed | self._faulty)

    @property
    def recovered(self) -> frozenset[str]:
        """The components that have recovered since the last decision."""
        return frozenset(self._recovered)

    def take_recovered(self) -> frozenset[str]:
        """Return the components that have recovered, each once: what fails after that is no matter of the recovery."""
        recovered, self._just_recovered = frozenset(self._just_recovered), set()
        return recovered

    def take_back(self) -> frozenset[str]:
        """Return the components of the system that were down and are no more, each once, by their full names."""
        back, self._back = frozenset(self._back), set()
        return back

    def decided(self, recovered: Collection[str]) -> None:
        """Note that a decision has taken recoveries into account; later ones are left for the next."""
        self._recovered -= set(recovered)

    def statuses(self) -> dict[str, ComponentStatus]:
        """Return the status of each component that is known."""
        found = dict.fromkeys(self._model.components, ComponentStatus.AVAILABLE)
        found |= dict.fromkeys(self._recovered, ComponentStatus.RECOVERED)
        return found | dict.fromkeys(self.failed, ComponentStatus.FAILED)

    def has_error(self, objective: str, since: float) -> bool:
        """Return whether what provides an objective since a time has reported an error of its own."""
        return self._errors.get(objective, -math.inf) > since

    def forget(self, objective: str) -> None:
        """Forget an objective that is over, and what it required."""
        self._errors = {name: stamp for name, stamp in self._errors.items() if not is_of(name, objective)}
        self.measurements.forget_all_of(objective)

    def _note_recoveries(self) -> None:
        failed = set(self.failed)
        self._recovered = (self._recovered | (self._seen_failed - failed)) - failed
        self._just_recovered = (self._just_recovered | (self._seen_failed - failed)) - failed
        self._seen_failed = failed
        down = set(self.down)
        self._back = (self._back | (self._seen_down - down)) - down
        self._seen_down = down


def _number(value: PlainValue) -> float | None:
    """Return a finite number, given as one or as text, None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None
