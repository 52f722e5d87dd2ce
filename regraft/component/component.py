"""The base class of all components: declare ports, parameters, services and timers; the kit does the rest."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage, BadType
from regraft.bus_schema.keys import own_name
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Description, Resources, check_amounts, check_devices
from regraft.component.handlers import LONGEST, Period, Service, period_of, service_of
from regraft.component.kit import Kit
from regraft.component.parameters import Parameter, ParameterError, ParameterSet, limited
from regraft.component.ports import Input, Output, handled_by, with_handler
from regraft.component.quality import Quality
from regraft.component.reserved import check_attributes

SHORTEST_PERIOD = 0.01
"""Seconds: a component that measures or saves its state more often does little else."""
OR_NEVER = ", or None for never"
PERIODS = {"evaluate_every": OR_NEVER, "checkpoint_every": OR_NEVER, "handler_timeout": ""}
InputQualities = Mapping[str, Mapping[str, float]]
"""The qualities of what feeds a component, by input port and quality."""


class Component:
    """A part of a robot that runs as a process, with a lifecycle, parameters and ports.

    Everything that reaches a component passes through one inbox and one thread: handlers run one at a time, and an
    ``async`` one lets others run only where it awaits. The kit hides behind one name, ``self.kit``.
    """

    kit: Kit

    handler_timeout: ClassVar[float] = 0.3
    """Seconds that one handler may keep the loop before the host takes the component for hung."""
    state_version: ClassVar[int] = 0
    """Version of what ``snapshot`` returns; a state of another version is not restored, unless it can be converted.

    Classes that may replace each other give a version the same meaning.
    """
    converts_versions: ClassVar[tuple[int, ...]] = ()
    """Other versions of a state, which ``convert_state`` turns into that of this class."""
    checkpoint_every: ClassVar[float | None] = None
    """Seconds between checkpoints, which the host keeps and gives back after a crash; None for no checkpoints."""
    evaluate_every: ClassVar[float | None] = 1.0
    """Seconds between publications of what ``evaluate`` gives, for the system's side; None for no publications."""
    resources: ClassVar[Resources] = Resources()
    """The component's demand on its host."""
    lockstep: ClassVar[bool] = True
    """Whether the component is a member of simulated time; an onlooker (a gateway) lives by the wall clock."""

    removal_forbidden: ClassVar[str] = ""
    """Why a running system cannot be without the component, so that it cannot be removed; empty if it can."""
    is_time_source: ClassVar[bool] = False
    """Whether the component makes simulated time continue, as a `TimeSource` does."""
    exclusive: ClassVar[bool] = False
    """Whether the component, from ``on_configure`` to ``on_cleanup``, holds what only one process can hold: a device, a
    port, a lock. A run that is succeeded releases it first. A class with devices in ``resources`` is exclusive too.
    """
    listens_at_port: ClassVar[bool] = False
    """Whether the component listens at its parameters ``address`` and ``port``, which ``regraft up`` tries first."""

    def __init_subclass__(cls, **more: Any) -> None:
        """Refuse a class that uses a name of this one for something else; raises BadType."""
        super().__init_subclass__(**more)
        check_attributes(cls, Component)

    @classmethod
    def is_exclusive(cls) -> bool:
        """Return whether another process must release something before this one can be configured."""
        return cls.exclusive or bool(cls.resources.devices)

    @classmethod
    def preload(cls) -> str | None:
        """Prepare what all processes of this class share, once, before any is started: imports, probing hardware.

        It must start no thread and open no device. A returned line is shown once to the person who starts the system,
        such as what this machine lacks.
        """
        return None

    @classmethod
    def parameters_for(cls, parameters: dict[str, Any]) -> Iterable[Parameter[Any]]:
        """Name the parameters that a component has by its read-only ``parameters``, in addition to those of its class.

        Each needs a ``name``; its value is found in ``kit.parameters.values``, not as an attribute.

        Raises:
            ParameterError: the parameters make no sense together.
        """
        return ()

    @classmethod
    def ports_for(cls, parameters: dict[str, Any]) -> Iterable[Input[Any] | Output[Any]]:
        """Name the ports that a component has by its read-only ``parameters``, next to those of its class.

        Each needs a ``name`` and an ``origin``; it is found in ``kit.inputs`` or ``kit.outputs``, not as an attribute.

        Raises:
            ParameterError: the parameters make no sense together.
        """
        return ()

    @classmethod
    def qualities_for(cls, parameters: dict[str, Any]) -> Iterable[Quality]:
        """Name the qualities that a component has by its read-only ``parameters``, next to those of its class.

        Each needs a ``name``.
        """
        return ()

    @classmethod
    def check_parameters(cls, parameters: dict[str, Any], seed: int) -> None:
        """Find what would keep a component with these ``parameters`` from being configured, before anything starts.

        It runs on the machine where the stack is started, and may read files. It must start no thread and open no
        device.

        Raises:
            ParameterError: with the dotted paths of values and why they are wrong.
            ValueError: all of it is wrong.
        """

    @classmethod
    def check_architecture(cls, name: str, parameters: dict[str, Any], architecture: Architecture) -> None:
        """Find what would keep the component ``name`` from its work among the others, before anything starts.

        It runs where `check_parameters` does, and after it, with the whole stack as it is to be at first.

        Raises:
            ParameterError: with the dotted paths of values and why they are wrong.
            ValueError: all of it is wrong.
        """

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Report what qualities it would give under ``parameters`` in ``context``, without running (ReFrESH ES).

        Values of names that are declared as no `Quality` do not count, nor those outside its range.
        """
        return {}

    @classmethod
    def estimate_from_inputs(
        cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue], inputs: InputQualities
    ) -> dict[str, float]:
        """Report what ``estimate`` does, given what feeds the component; override it where that matters.

        ``inputs`` has for each input port the qualities of the component that feeds it, such as
        ``inputs["image"]["rate"]``: none where nothing feeds it, or nothing is known. In a cycle of connections they
        are those that were measured last.
        """
        return cls.estimate(parameters, context)

    def evaluate(self) -> dict[str, float]:
        """Report what qualities the running component gives now (ReFrESH EV).

        Only those that are declared as a `Quality` count. One that is left out is unknown. It is called between two
        handlers, every ``evaluate_every`` seconds, and must change nothing.
        """
        return {}

    def on_configure(self) -> None:
        """Prepare: load, connect, allocate. An exception leads to ``on_error``."""

    def on_activate(self) -> None:
        """Begin to act; messages and ticks come from now on."""

    def on_deactivate(self) -> None:
        """Stop acting; running tasks have been cancelled."""

    def on_cleanup(self) -> None:
        """Give back what ``on_configure`` took."""

    def on_shutdown(self) -> None:
        """Leave for good."""

    def on_error(self) -> None:
        """Recover from an exception in another hook: return and be unconfigured, or raise and be finalized."""

    def on_parameters(self, changed: frozenset[str]) -> None:
        """React to parameters that have just changed, all at once."""

    def snapshot(self) -> PlainValue:
        """Return the component's state as plain data, for a successor or a checkpoint; None if there is none.

        It is packed a little later, so it must share nothing that changes.
        """
        return None

    def restore(self, state: PlainValue) -> None:
        """Continue from a state that ``snapshot`` returned, before ``on_activate``."""

    @classmethod
    def convert_state(cls, state: PlainValue, version: int) -> PlainValue:
        """Return a state of one of ``converts_versions`` as one of this class's version."""
        return state

    @classmethod
    def restorable_versions(cls) -> tuple[int, ...]:
        """Return the versions of a state that this class can continue from; none without ``restore``."""
        return (cls.state_version, *cls.converts_versions) if cls.restore is not Component.restore else ()


@dataclass(frozen=True, slots=True)
class Declared:
    """All that a component class declares."""

    inputs: dict[str, Input[Any]]
    outputs: dict[str, Output[Any]]
    parameters: dict[str, Parameter[Any]]
    services: dict[str, Service]
    timers: dict[str, Period]
    qualities: dict[str, Quality]


_declared: dict[type[Any], Declared] = {}


def declared(cls: type[Any]) -> Declared:
    """Return what a class and its bases declare, in order of declaration.

    Raises:
        BadType: a service is ill-typed, two services or qualities share a name, or measuring has no possible period.
        BadKey: the name of a port, parameter or quality is too long.
    """
    known = _declared.get(cls)
    if known is not None:
        return known
    found = Declared({}, {}, {}, {}, {}, {})
    names = dict.fromkeys(name for base in reversed(cls.__mro__) for name in vars(base))
    for name in names:
        attribute = inspect.getattr_static(cls, name)
        if isinstance(attribute, Input):
            found.inputs[name] = attribute
        elif isinstance(attribute, Output):
            found.outputs[name] = attribute
        elif isinstance(attribute, Parameter):
            found.parameters[name] = attribute
        elif isinstance(attribute, Quality):
            _take_quality(found.qualities, attribute)
        elif inspect.isfunction(attribute):
            _take_function(found, name, attribute)
    _add_handlers(cls, found.inputs)
    for name in (*found.inputs, *found.outputs):
        own_name(name, "port")
    for name in found.parameters:
        own_name(name, "parameter")
    _check_periods(cls)
    _declared[cls] = found
    return found


def _add_handlers(cls: type[Any], inputs: dict[str, Input[Any]]) -> None:
    """Give inputs the handlers that the class and its bases declare; a subclass's declaration is not its bases'."""
    for base in reversed(cls.__mro__):
        for name, attribute in vars(base).items():
            for port in handled_by(attribute) if inspect.isfunction(attribute) else ():
                if inspect.getattr_static(cls, port.name, None) is port:
                    inputs[port.name] = with_handler(port, name)


def _check_periods(cls: type[Any]) -> None:
    for attribute, or_never in PERIODS.items():
        seconds = getattr(cls, attribute, None)
        if seconds is not None and not SHORTEST_PERIOD <= seconds <= LONGEST:
            right = f"must be between {SHORTEST_PERIOD:g} and {LONGEST:g} s{or_never}"
            raise BadType(f"{class_path(cls)}: {attribute} = {seconds!r}: {right}")


def parameter_set(cls: type[Component], given: Mapping[str, Any]) -> ParameterSet:
    """Return the parameters that a component of the class has when it starts with the ``given`` values.

    Raises:
        BadType: see `declared`.
        ParameterError: the values do not fit the class.
    """
    of_class = declared(cls).parameters
    fixed = ParameterSet({name: parameter for name, parameter in of_class.items() if parameter.read_only})
    fixed.set({name: value for name, value in given.items() if name in fixed.declared}, starting=True)
    by_parameters = {parameter.name: parameter for parameter in cls.parameters_for(fixed.values)}
    twice = sorted(by_parameters.keys() & of_class.keys())
    if twice:
        raise ParameterError([(name, "the class has a parameter of this name already") for name in twice])
    values = ParameterSet(limited({**of_class, **by_parameters}, given))
    values.set(given, starting=True)
    return values


def declared_for(cls: type[Component], parameters: ParameterSet) -> Declared:
    """Return what a component of the class declares that has these parameters.

    Raises:
        BadType: see `declared`.
        ParameterError: the ports that the parameters ask for cannot be.
    """
    parts = declared(cls)
    fixed = {name: parameters.values[name] for name, parameter in parts.parameters.items() if parameter.read_only}
    inputs, outputs = dict(parts.inputs), dict(parts.outputs)
    problems = []
    for port in cls.ports_for(fixed):
        namesake = inputs.get(port.name) or outputs.get(port.name)
        if namesake is not None:
            whose = f"{namesake.origin} asks for" if namesake.origin else "the class has"
            problems.append((port.origin, f"{whose} a port {port.name!r} already: each needs a name of its own"))
        elif isinstance(port, Input):
            inputs[port.name] = port
        else:
            outputs[port.name] = port
    if problems:
        raise ParameterError(problems)
    qualities = dict(parts.qualities)
    for quality in cls.qualities_for(fixed):
        _take_quality(qualities, quality)
    return replace(parts, inputs=inputs, outputs=outputs, parameters=dict(parameters.declared), qualities=qualities)


def _take_quality(qualities: dict[str, Quality], quality: Quality) -> None:
    if quality.name in qualities:
        raise BadType(f"two qualities have the name {quality.name!r}")
    qualities[own_name(quality.name, "quality")] = quality


def _take_function(found: Declared, name: str, function: Any) -> None:
    offered = service_of(name, function)
    if offered:
        if offered.name in found.services:
            raise BadType(f"two methods offer the service {offered.name!r}")
        found.services[offered.name] = offered
    period = period_of(function)
    if period:
        found.timers[name] = period


def class_path(cls: type) -> str:
    """Return ``module:Class``."""
    return f"{cls.__module__}:{cls.__qualname__}"


def describe(cls: type[Component], parameters: Mapping[str, Any] | None = None) -> Description:
    """Return a component class's description, without running it, given parameters other than its defaults.

    Raises:
        BadType: see `declared`; or an amount or device of its resources cannot be.
        ParameterError: the parameters do not fit the class.
    """
    parts = declared_for(cls, parameter_set(cls, parameters or {}))
    try:
        check_amounts(cls.resources.amounts)
        check_devices(cls.resources.devices)
    except BadMessage as error:
        raise BadType(f"resources.{error}") from None
    text = (inspect.getdoc(cls) or "").split("\n\n")[0]
    return Description(
        class_path(cls),
        text,
        (
            *(port.describe() for port in parts.inputs.values()),
            *(port.describe() for port in parts.outputs.values()),
        ),
        tuple(parameter.describe() for parameter in parts.parameters.values()),
        tuple(offered.describe() for offered in parts.services.values()),
        cls.state_version,
        cls.handler_timeout,
        cls.resources,
        cls.lockstep,
        cls.removal_forbidden,
        cls.snapshot is not Component.snapshot,
        cls.restorable_versions(),
        cls.is_time_source,
        cls.is_exclusive(),
        tuple(quality.describe() for quality in parts.qualities.values()),
        cls.evaluate_every if any(quality.describe().measured for quality in parts.qualities.values()) else None,
        cls.estimate_from_inputs.__func__ is not Component.estimate_from_inputs.__func__,  # type: ignore[attr-defined]
    )


def restore_state(component: Component, state: PlainValue, version: int) -> None:
    """Have a component continue from a state of one of its `Component.restorable_versions`."""
    component.restore(state if version == component.state_version else component.convert_state(state, version))
