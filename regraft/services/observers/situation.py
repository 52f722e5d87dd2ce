"""The values of names in the expressions of an observer, as they are now; a name that is not known has none.

``camera.state``, ``camera.active`` and ``camera.failed`` are read as in the rules of modes. Any other ``camera.NAME``
is a quality that the component measures. The rules on what counts, and until when, are the same as there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.management.system import (
    SystemFaultKind,
    SystemFaults,
    SystemMeasurements,
    SystemStates,
)
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expression_kinds import kind_problems
from regraft.bus_schema.model.expressions import Expression, Unknown
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.modes.mode_conditions import GONE, OF_COMPONENTS, NameKind, read_name
from regraft.bus_schema.model.robots.scopes import component_in_scope

KINDS: Final = {
    NameKind.STATE: ValueKind.TEXT,
    NameKind.ACTIVE: ValueKind.TRUTH,
    NameKind.FAILED: ValueKind.TRUTH,
    NameKind.QUALITY: ValueKind.NUMBER,
}


@dataclass(frozen=True, slots=True)
class Situation(Mapping[str, Any]):
    """The values of names at ``now``, for a component of a robot ``scope``; a lookup raises Unknown with the reason."""

    scope: str
    now: float
    states: SystemStates | None
    faults: SystemFaults | None
    measurements: SystemMeasurements | None

    def __getitem__(self, name: str) -> Any:
        """Return the value of a name; raises Unknown."""
        owner, _, field = name.rpartition(".")
        component = component_in_scope(self.scope, owner)
        kind = next((each for each in OF_COMPONENTS if each.value == field), NameKind.QUALITY)
        if kind is NameKind.QUALITY:
            return self._measured(name, component, field)
        if kind is NameKind.FAILED:
            if self.faults is None:
                raise Unknown(f"{name} is not known: nothing is known of faults yet")
            present = (each for each in self.faults.present if each.component == component)
            return any(each.kind is not SystemFaultKind.RAISED for each in present)
        return self._of_state(name, component, kind)

    def __iter__(self) -> Iterator[str]:
        """Yield nothing: names are looked up one by one."""
        return iter(())

    def __len__(self) -> int:
        return 0

    def _of_state(self, name: str, component: str, kind: NameKind) -> Any:
        known = self.states.components if self.states is not None else ()
        state = next((each for each in known if each.component == component), None)
        if state is None:
            raise Unknown(f"{name} is not known: nothing is known of {component}'s state")
        if kind is NameKind.ACTIVE:
            return state.state is State.ACTIVE
        return state.state.value if state.state else GONE

    def _measured(self, name: str, component: str, quality: str) -> float:
        latest = self.measurements.of(component) if self.measurements is not None else None
        if latest is None:
            raise Unknown(f"{name} is not measured: {component} is not active, or has measured nothing yet")
        why = latest.why_unknown(quality, self.now)
        if why:
            raise Unknown(f"{name} is not measured: {why}")
        return latest.values[quality]


def name_problems(expression: Expression, scope: str, architecture: Architecture, wanted: ValueKind) -> Iterable[str]:
    """Return what is wrong with the names of an expression, and with the kinds of their values."""
    problems = []
    kinds = {}
    for name in expression.names:
        owner, _, field = name.rpartition(".")
        if not owner:
            problems.append(f"{name!r} is no quality: must be such as 'component.quality'")
            continue
        try:
            known = read_name(f"{component_in_scope(scope, owner)}.{field}", architecture)
        except BadMessage as error:
            problems.append(str(error))
            continue
        if known.kind in KINDS:
            kinds[name] = KINDS[known.kind]
        else:
            problems.append(f"{name!r} has no place here: must be such as 'component.quality'")
    return problems or kind_problems(expression, kinds, wanted)
