"""The meaning of a model: effective states and parameters, the configuration of rest, observed components."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import (
    Component,
    Configuration,
    Parameter,
    Realization,
    SkillSet,
    Value,
)
from regraft.bus_schema.model.lifecycle import LASTING, State
from regraft.bus_schema.model.modes.mode_parts import DEFAULT

DEFAULT_CONTEXT: Final = "Default"
"""The context of normal operation, which each skill with realizations has to have (paper, section II-A)."""
CONTEXTS: Final = (DEFAULT_CONTEXT, "BatteryCharging", "OnChargingStation")
"""The contexts of the published grammar. They need no declaration."""
STATES: Final = tuple(state.value for state in State)
REACHABLE: Final = frozenset(state.value for state in LASTING)
INACTIVE: Final = State.INACTIVE.value
Values = dict[str, Value]


def is_default_name(name: str) -> bool:
    """Return whether a name means the default: ``DEFAULT``, ``_Default_mode``, ``__DEFAULT__``.

    >>> [is_default_name(name) for name in ("_DEFAULT_mode", "DEFAULT", "f_slow")]
    [True, True, False]
    """
    return "default" in name.lower()


def is_rest(realization: Realization) -> bool:
    """Return whether a realization is the configuration of rest, which is never chosen.

    Cancelling a skill leads there: nothing is active in it, or it is named like the default.
    """
    return is_default_name(realization.name) or not any(each.is_active for each in realization.components)


def is_realisable(realization: Realization) -> bool:
    """Return whether a system can stay in a realization. Components leave transition states, and end in finalized."""
    return all(each.target.state in REACHABLE for each in realization.components)


def choosable(skills: SkillSet) -> tuple[Realization, ...]:
    """Return the realizations that may be chosen, in their order."""
    return tuple(each for each in skills.realizations if is_realisable(each) and not is_rest(each))


def observed(skills: SkillSet) -> tuple[str, ...]:
    """Return the components that are tagged as observable anywhere, in their order."""
    every = [*skills.components, *(each for one in skills.realizations for each in one.components)]
    return tuple(dict.fromkeys(each.name for each in every if each.observable))


def mode_name(configuration: Configuration) -> str:
    """Return the mode of a component that an active configuration means; ``active`` and ``active.DEFAULT`` are one."""
    mode = configuration.mode
    return DEFAULT if not mode or mode.strip("_").lower() == "default" else mode


@dataclass(frozen=True, slots=True)
class Configurations:
    """The values of each component's modes, wherever they are given.

    ``modes`` has what each mode sets itself. ``defaults`` has the values of the default mode: all parameters that any
    mode sets. A value that a mode leaves out is the default's. A value that the default mode lacks is the first given.
    """

    modes: Mapping[str, Mapping[str, Values]]
    defaults: Mapping[str, Values]

    def parameters(self, component: str, mode: str) -> Values:
        """Return the effective values of a mode."""
        return self.defaults.get(component, {}) | self.modes.get(component, {}).get(mode, {})

    def differences(self, component: str, mode: str) -> Values:
        """Return the values of a mode that are not those of the default mode."""
        defaults = self.defaults.get(component, {})
        own = self.modes.get(component, {}).get(mode, {})
        return {name: value for name, value in own.items() if _typed(value) != _typed(defaults[name])}


def configurations_of(skills: SkillSet) -> Configurations:
    """Return the configurations of all components. A configuration that is only named has its parameters elsewhere."""
    found: dict[str, dict[str, Values]] = {}
    for component in every_component(skills):
        modes = found.setdefault(component.name, {})
        for each in component.configurations:
            if each.is_active:
                mode = mode_name(each)
                modes[mode] = modes.get(mode) or _values(each.parameters or ())
    defaults: dict[str, Values] = {}
    for name, modes in found.items():
        known = defaults[name] = dict(modes.get(DEFAULT, {}))
        for values in modes.values():
            for parameter, value in values.items():
                known.setdefault(parameter, value)
    return Configurations(found, defaults)


def every_component(skills: SkillSet) -> Iterable[Component]:
    """Yield all components with their configurations: those declared on their own first."""
    yield from skills.components
    for realization in skills.realizations:
        yield from realization.components


def components_of(realizations: Iterable[Realization]) -> tuple[str, ...]:
    """Return the names of all components that some realizations use, in their order."""
    return tuple(dict.fromkeys(each.name for one in realizations for each in one.components))


def expected(realization: Realization) -> dict[str, float]:
    """Return the expected value of each quality: the one that holds everywhere, else the first that is given."""
    everywhere = [each for each in realization.estimates if not each.environments]
    given = [*everywhere, *realization.estimates]
    return {each.quality: each.value for each in reversed(given)}


def _typed(value: Value) -> tuple[type, Value]:
    """Return a value that differs also where its type does: system_modes compares both."""
    return type(value), value


def _values(parameters: Iterable[Parameter]) -> Values:
    return {each.name: each.value for each in parameters if each.value is not None}
