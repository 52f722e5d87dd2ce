"""Parameters of a component: typed, bounded, described; set several at once or none."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any, Generic, Protocol, TypeVar, overload

from regraft.bus_schema.errors import BadType
from regraft.bus_schema.model.description import ParameterDescription
from regraft.bus_schema.model.parameter_values import parameter_problem
from regraft.bus_schema.suggestions import Hints, instead_of

V = TypeVar("V", bool, int, float, str, tuple[float, ...], tuple[str, ...])

JSON_TYPES: dict[type, str] = {bool: "boolean", int: "integer", float: "number", str: "string", tuple: "array"}
_NAMES_OF_TYPES = ", ".join(each.__name__ for each in JSON_TYPES)


class ParameterError(ValueError):
    """Values that cannot be set.

    Attributes:
        parts: what is wrong, each as the parameter or the part of it, and why.
        problems: the same as texts.
    """

    def __init__(self, parts: Sequence[tuple[str, str]]) -> None:
        self.parts = tuple(parts)
        self.problems = tuple(f"{place}: {why}" for place, why in parts)
        super().__init__("; ".join(self.problems))


class CurrentValues(Protocol):
    """The current values of parameters."""

    @property
    def values(self) -> Mapping[str, Any]:
        """The values by name."""


class KitWithParameters(Protocol):
    """The part of a kit that parameters need."""

    @property
    def parameters(self) -> CurrentValues:
        """The parameters of its component, or device."""


class HasParameters(Protocol):
    """A component or a device, as its parameters see it."""

    @property
    def kit(self) -> KitWithParameters:
        """Its kit."""


class Parameter(Generic[V]):
    """A parameter of a component class; on an instance it reads as its current value.

    >>> from regraft import Component, Parameter
    >>> class Drive(Component):
    ...     "Drives."
    ...     max_velocity = Parameter(0.26, minimum=0.0, maximum=0.26, unit="m/s")
    """

    def __init__(
        self,
        default: V,
        description: str = "",
        *,
        minimum: float | None = None,
        maximum: float | None = None,
        choices: Sequence[V] = (),
        unit: str = "",
        read_only: bool = False,
        exists: bool = False,
        from_robot: str = "",
        limit: str = "",
    ) -> None:
        """Declare a parameter by its default, whose type is the parameter's type.

        One that ``exists`` is a path (its unit) to a file. A file that is named has to be there before the component
        starts. A stack that leaves out a parameter ``from_robot`` gives it the parameter of this name of the
        component's robot. ``limit`` names a read-only number of the same component, whose value is the maximum.
        """
        self.name = ""
        self.default: V = default
        self.read_only = read_only
        self.from_robot = from_robot
        self.limit = limit
        if type(default) not in JSON_TYPES:
            raise TypeError(f"a parameter's default is of type {type(default).__name__}, must be of {_NAMES_OF_TYPES}")
        schema: dict[str, Any] = {"type": JSON_TYPES[type(default)]}
        if isinstance(default, tuple):
            schema["items"] = {"type": JSON_TYPES[type(default[0])] if default else ["number", "string"]}
        bounds = {"minimum": minimum, "maximum": maximum}
        schema |= {key: bound for key, bound in bounds.items() if bound is not None}
        if choices:
            schema["enum"] = list(choices)
        self._described = ParameterDescription("", default, schema, unit, read_only, description, exists)

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        self.default = self.checked(self.default)
        self._described = replace(self._described, name=name, default=self.plain(self.default))

    @overload
    def __get__(self, instance: None, owner: type) -> Parameter[V]: ...

    @overload
    def __get__(self, instance: HasParameters, owner: type) -> V: ...

    def __get__(self, instance: HasParameters | None, owner: type) -> Parameter[V] | V:
        """Return the declaration on the class, the current value on an instance."""
        if instance is None:
            return self
        value: V = instance.kit.parameters.values[self.name]
        return value

    def __set__(self, instance: HasParameters, value: V) -> None:
        """Refuse assignment: parameters are changed by adaptations, so that everybody knows of it."""
        raise AttributeError(f"parameter {self.name!r} is changed by an adaptation, not by assignment")

    def checked(self, value: Any) -> V:
        """Return ``value`` in the parameter's type; raises ParameterError stating what would be right."""
        problem = parameter_problem(self._described, value)
        if problem:
            raise ParameterError([(self.name, problem)])
        wanted = type(self.default)
        checked: V = wanted(value) if wanted in (float, tuple) else value
        return checked

    @property
    def choices(self) -> tuple[V, ...]:
        """The values that it can have; empty where its type and bounds alone define them."""
        return tuple(self._described.schema.get("enum", ()))

    def renamed(self, name: str, default: Any, limit: str = "") -> Parameter[V]:
        """Return the same parameter with another name, default and limit, by default none; raises ParameterError."""
        other = copy(self)
        other.limit = limit
        other.default = self.checked(default)
        other.name = name
        other._described = replace(self._described, name=name, default=self.plain(other.default))
        return other

    def at_most(self, maximum: Any) -> Parameter[V]:
        """Return the same parameter with no more than this maximum, which its default keeps too.

        Raises:
            ParameterError: nothing is left between its minimum and this maximum.
        """
        schema = self._described.schema
        least = min(maximum, schema.get("maximum", maximum))
        least = math.floor(least) if isinstance(self.default, int) else least
        other = copy(self)
        other._described = replace(self._described, schema={**schema, "maximum": least})
        return other.renamed(self.name, min(self.default, least), self.limit)

    def plain(self, value: Any) -> Any:
        """Return a value as plain data."""
        return list(value) if isinstance(value, tuple) else value

    def describe(self) -> ParameterDescription:
        """Return the parameter's description, with a JSON Schema of its values."""
        return self._described


@dataclass(slots=True)
class ParameterSet:
    """The current values of one component's parameters."""

    declared: Mapping[str, Parameter[Any]]
    values: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.values = {name: parameter.default for name, parameter in self.declared.items()} | self.values

    def check(self, wanted: Mapping[str, Any], *, starting: bool = False) -> dict[str, Any]:
        """Return ``wanted`` in the right types.

        Raises:
            ParameterError: with every problem, if a name is unknown, a value unfit, or a read-only one would change.
        """
        problems: list[tuple[str, str]] = []
        fit = {}
        known = Hints(self.declared)
        for name, value in wanted.items():
            parameter = self.declared.get(name)
            if parameter is None:
                problems.append((name, f"there is no such parameter; {known.instead_of(name)}"))
                continue
            try:
                fit[name] = parameter.checked(value)
            except ParameterError as error:
                problems += error.parts
                continue
            if parameter.read_only and not starting and fit[name] != self.values[name]:
                problems.append((name, "is read-only, set when the component starts"))
        if problems:
            raise ParameterError(problems)
        return fit

    def set(self, wanted: Mapping[str, Any], *, starting: bool = False) -> None:
        """Set all of ``wanted`` or, if any does not fit, none."""
        self.values = {**self.values, **self.check(wanted, starting=starting)}

    def plain(self) -> dict[str, Any]:
        """Return the current values as plain data."""
        return {name: self.declared[name].plain(value) for name, value in self.values.items()}


def limited(declared: Mapping[str, Parameter[Any]], given: Mapping[str, Any]) -> dict[str, Parameter[Any]]:
    """Return parameters whose maximum is no more than their limit, by the ``given`` values of read-only ones.

    Raises:
        BadType: a limit is no read-only parameter among them.
        ParameterError: a limit has a value that does not fit, or leaves nothing.
    """
    fixed = {name: parameter for name, parameter in declared.items() if parameter.read_only}
    limits = ParameterSet(
        {parameter.limit: fixed[parameter.limit] for parameter in declared.values() if parameter.limit in fixed}
    )
    limits.set({name: value for name, value in given.items() if name in limits.declared}, starting=True)
    return {name: _limited(parameter, fixed, limits.values) for name, parameter in declared.items()}


def _limited(parameter: Parameter[Any], fixed: Mapping[str, Any], limits: Mapping[str, Any]) -> Parameter[Any]:
    if not parameter.limit:
        return parameter
    if parameter.limit not in fixed:
        why = f"its limit {parameter.limit!r} must be a read-only parameter of the same class"
        raise BadType(f"parameter {parameter.name!r}: {why}; {instead_of(parameter.limit, fixed)}")
    try:
        return parameter.at_most(limits[parameter.limit])
    except ParameterError as error:
        whose = f"the least of {parameter.name!r}, whose limit it is"
        raise ParameterError([(parameter.limit, f"{why}, {whose}") for _, why in error.parts]) from None
