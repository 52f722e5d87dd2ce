"""The values of the names in conditions, as they are now; a name that is not known has none."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from regraft import Kit
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.management.modes import SystemModes
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.management.system import SystemFaultKind, SystemFaults, SystemQualities, SystemStates
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.modes.mode_conditions import GONE, ConditionName, NameKind, values_of_modes

Names = Mapping[str, ConditionName]


def values_of(
    names: Names,
    states: SystemStates | None,
    faults: SystemFaults | None,
    requirements: SystemQualities | None,
    modes: SystemModes,
) -> dict[str, Any]:
    """Return the values of all names but those of components' qualities."""
    found: dict[str, Any] = dict(
        values_of_modes(
            names, {part.part: part.target for part in modes.parts}, {part.part: part.actual for part in modes.parts}
        )
    )
    for name, known in names.items():
        if known.kind is NameKind.REQUIREMENT:
            value = _requirement(known, requirements)
        else:
            value = _of_component(known, states, faults)
        if value is not None:
            found[name] = value
    return found


def _of_component(known: ConditionName, states: SystemStates | None, faults: SystemFaults | None) -> Any:
    if known.kind is NameKind.FAILED:
        if faults is None:
            return None
        return any(each.component == known.owner and each.kind is not SystemFaultKind.RAISED for each in faults.present)
    if known.kind not in (NameKind.STATE, NameKind.ACTIVE) or states is None:
        return None
    state = next((each for each in states.components if each.component == known.owner), None)
    if state is None:
        return None
    if known.kind is NameKind.ACTIVE:
        return state.state is State.ACTIVE
    return state.state.value if state.state else GONE


def _requirement(known: ConditionName, requirements: SystemQualities | None) -> Any:
    qualities = requirements.qualities if requirements else ()
    found = next((each for each in qualities if each.requirement == known.owner), None)
    return getattr(found, known.field) if found is not None and found.active else None


class MeasuredValues:
    """The qualities of components that conditions speak of, as the components measured them last."""

    def __init__(self, kit: Kit, within: float) -> None:
        """Wait ``within`` seconds for an answer."""
        self._kit = kit
        self._keys = Keys(kit.system)
        self._within = within

    async def read(self, names: Names, states: SystemStates | None) -> dict[str, float]:
        """Return the values that count, by name; only an active component has any."""
        wanted = {name: known for name, known in names.items() if known.kind is NameKind.QUALITY}
        runs = {each.component: each.incarnation for each in (states.components if states else ()) if each.state}
        if not wanted:
            return {}
        found: dict[str, dict[str, float]] = {}
        async with self._kit.exclusive():
            for component in sorted({known.owner for known in wanted.values()} & runs.keys()):
                found[component] = await self._ask(component, runs[component])
        values = ((name, found.get(known.owner, {}).get(known.field)) for name, known in wanted.items())
        return {name: value for name, value in values if value is not None}

    async def _ask(self, component: str, incarnation: int) -> dict[str, float]:
        answers = await self._kit.ask(self._keys.control(component, incarnation, "qualities"), b"", self._within)
        for answer in answers:
            if not answer.error:
                try:
                    return dict(codec.decode(answer.payload, MeasuredQualities).values)
                except BadMessage:
                    continue
        return {}
