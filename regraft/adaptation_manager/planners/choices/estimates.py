"""Estimates: the qualities that components are expected to give, under settings that are not in force yet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from regraft.adaptation_manager.planners.choices.settings import Kind, Setting
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Unknown
from regraft.component.component import describe
from regraft.component.predicting import predicted
from regraft.process.main import NoSuchClass, load_class


class Estimator(Protocol):
    """Where the expected qualities of components come from."""

    def knows(self, component: str) -> bool:
        """Return whether there is such a component."""
        ...

    def depends_on(self, component: str, setting: Setting) -> bool:
        """Return whether a component's estimates may be others under a setting."""
        ...

    def estimate(
        self, component: str, settings: Sequence[Setting], context: Mapping[str, PlainValue]
    ) -> Mapping[str, float | Unknown]:
        """Return a component's qualities by name, or why one is unknown, under those settings that it depends on.

        Raises:
            Unknown: all of them are unknown.
        """
        ...


class NoEstimates:
    """Nothing is estimated: for what is measured."""

    def knows(self, component: str) -> bool:
        """Return that there is no such component."""
        return False

    def depends_on(self, component: str, setting: Setting) -> bool:
        """Return that there are no estimates that could depend on anything."""
        return False

    def estimate(
        self, component: str, settings: Sequence[Setting], context: Mapping[str, PlainValue]
    ) -> dict[str, float]:
        """Raise Unknown."""
        raise Unknown(f"nothing is estimated of {component}")


class ClassEstimates:
    """Each class estimates for itself, under the parameters that an architecture and the settings give it."""

    def __init__(self, architecture: Architecture) -> None:
        self._components = architecture.components

    def knows(self, component: str) -> bool:
        """Return whether there is such a component."""
        return component in self._components

    def depends_on(self, component: str, setting: Setting) -> bool:
        """Return whether a setting is one of the component's own parameters, or its class."""
        return setting.component == component and setting.kind in (Kind.PARAMETER, Kind.CLASS)

    def estimate(
        self, component: str, settings: Sequence[Setting], context: Mapping[str, PlainValue]
    ) -> dict[str, float | Unknown]:
        """Return what a component's class expects to give, or why that does not count; raises Unknown."""
        spec = self._components[component]
        own = [setting for setting in settings if setting.component == component]
        changed = {setting.member: setting.value for setting in own if setting.kind is Kind.PARAMETER}
        path = next((str(setting.value) for setting in own if setting.kind is Kind.CLASS), spec.cls)
        try:
            cls = load_class(path)
            described = spec.description if path == spec.cls and spec.description else describe(cls)
            defaults = {parameter.name: parameter.default for parameter in described.parameters}
            found = predicted(cls, described.qualities, defaults | spec.parameters | changed, context)
            why = {name: Unknown(f"{component}.{name} is {problem}") for name, problem in found.problems.items()}
            return {**found.values, **why}
        except NoSuchClass as error:
            raise Unknown(f"{component}: {error}") from None
        except (ArithmeticError, KeyError, TypeError, ValueError) as error:
            raise Unknown(f"{component} cannot estimate: {type(error).__name__}: {error}") from None
