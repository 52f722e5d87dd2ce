"""The values of the names in conditions, as they are now; a name that is not known has none."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from regraft import Kit
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.management.modes import SystemModes
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.management.system import SystemFaultKind, SystemFaults, SystemQualities, SystemStates
from regraft.bus_schema.model.adaptation import ChangeState
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Unknown
from regraft.bus_schema.model.lifecycle import DOWNWARD, PRIMARY, State, Transition, is_lower
from regraft.bus_schema.model.modes.mode_conditions import GONE, ConditionName, NameKind, values_of_modes

Names = Mapping[str, ConditionName]


def values_of(
    names: Names,
    states: SystemStates | None,
    faults: SystemFaults | None,
    requirements: SystemQualities | None,
    modes: SystemModes,
    measured: Values,
) -> Values:
    """Return the values of all names; ``measured`` are those of components' qualities."""
    found: dict[str, Any] = dict(
        values_of_modes(
            names, {part.part: part.target for part in modes.parts}, {part.part: part.actual for part in modes.parts}
        )
    )
    why: dict[str, str] = {}
    for name, known in names.items():
        if known.kind is NameKind.REQUIREMENT:
            value, why[name] = _requirement(known, requirements)
        else:
            value = _of_component(known, states, faults)
        if value is not None:
            found[name] = value
    return Values({**found, **measured}, {**why, **measured.why})


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


def fallen_out(
    wanted: Mapping[str, Collection[str]],
    architecture: Architecture,
    states: SystemStates | None,
    faults: SystemFaults | None,
) -> list[str]:
    """Return the modes of which a component does less than it should, and has not failed: nobody has brought it back.

    ``wanted`` are the components that each mode configures or activates.
    """
    if states is None or faults is None:
        return []
    failed = {each.component for each in faults.present if each.kind is not SystemFaultKind.RAISED}

    def has_fallen(name: str) -> bool:
        spec, state = architecture.components.get(name), states.state_of(name)
        if spec is None or state not in PRIMARY or name in failed:
            return False
        return is_lower(state, spec.state)

    return [mode for mode, components in wanted.items() if any(map(has_fallen, components))]


def wanted_by(modes: Iterable[str], architecture: Architecture) -> dict[str, tuple[str, ...]]:
    """Return the components that each mode configures or activates."""
    return {
        mode: tuple(
            change["component"]
            for change in architecture.modes[mode]
            if change["change"] == ChangeState.change and Transition(change["transition"]) not in DOWNWARD
        )
        for mode in modes
        if mode in architecture.modes
    }


def _requirement(known: ConditionName, requirements: SystemQualities | None) -> tuple[Any, str]:
    """Return the value of a requirement's field, None if it is not known, and why."""
    qualities = requirements.qualities if requirements else ()
    found = next((each for each in qualities if each.requirement == known.owner), None)
    if found is None:
        return None, "the requirement was never reported"
    return (getattr(found, known.field), "not measured") if found.active else (None, "the requirement is not active")


class Values(dict[str, Any]):
    """The values of names; those without one are unknown, for the reasons in ``why`` as far as there are any."""

    def __init__(self, values: Mapping[str, Any], why: Mapping[str, str]) -> None:
        super().__init__(values)
        self.why = why

    def __missing__(self, name: str) -> Any:
        why = self.why.get(name, "")
        raise Unknown(f"{name} is not known" + (f": {why}" if why else ""))


class MeasuredValues:
    """The qualities of components that conditions speak of, as the components measured them last."""

    def __init__(self, kit: Kit, within: float) -> None:
        """Wait ``within`` seconds for an answer."""
        self._kit = kit
        self._keys = Keys(kit.system)
        self._within = within

    async def read(self, names: Names, states: SystemStates | None) -> Values:
        """Return the values that count, by name; only an active component has any."""
        wanted = {name: known for name, known in names.items() if known.kind is NameKind.QUALITY}
        runs = {each.component: each.incarnation for each in (states.components if states else ()) if each.state}
        if not wanted:
            return Values({}, {})
        found: dict[str, MeasuredQualities | str] = {}
        async with self._kit.exclusive():
            for component in sorted({known.owner for known in wanted.values()}):
                run = runs.get(component)
                found[component] = f"{component} has no run" if run is None else await self._ask(component, run)
        values: dict[str, float] = {}
        why: dict[str, str] = {}
        for name, known in wanted.items():
            measured = found[known.owner]
            if isinstance(measured, str):
                why[name] = measured
            elif known.field in measured.values:
                values[name] = measured.values[known.field]
            else:
                why[name] = measured.unknown.get(known.field, "not given")
        return Values(values, why)

    async def _ask(self, component: str, incarnation: int) -> MeasuredQualities | str:
        """Return what a component measured, or why that is not known."""
        answers = await self._kit.ask(self._keys.control(component, incarnation, "qualities"), b"", self._within)
        for answer in answers:
            if not answer.error:
                try:
                    return codec.decode(answer.payload, MeasuredQualities)
                except BadMessage as error:
                    return str(error)
        return f"{component} does not answer"
