"""Fits robots with their devices: finds the classes, and lists the parameters and ports that these bring."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

from regraft import Input, Output, Parameter, Quality
from regraft.bus_schema.errors import BadType
from regraft.bus_schema.model.robots.scopes import in_scope
from regraft.bus_schema.suggestions import instead_of
from regraft.component.component import Declared, declared
from regraft.component.parameters import ParameterError, limited
from regraft.process.modules import CannotImport, imported
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.robots import DeviceSpec, RobotSpec


class NoSuchDevice(ValueError):
    """``module:Class`` does not name a device class; the text states what is wrong."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """One device of one robot, and where the parameter ``robots`` has it."""

    robot: RobotSpec
    spec: DeviceSpec
    cls: type[Device]
    place: str

    @property
    def declared(self) -> Declared:
        """Return what its class declares."""
        return declared(self.cls)

    def parameter(self, short: str) -> str:
        """Return the world's name of a parameter."""
        return f"{self.robot.prefix}{self.spec.name}_{short}"

    def port(self, short: str) -> str:
        """Return the world's name of a port, which is its topic's: the one that the robot's file connects it to."""
        return in_scope(self.robot.name, self.spec.connections.get(short, short))

    def asks_for(self, short: str, port: Input[Any] | Output[Any]) -> str:
        """Return the place that asks for a port to have a topic, empty where it may have none."""
        if short in self.spec.connections:
            return f"{self.place}.connect.{short}"
        return self.place if port.required else ""


Use = tuple[Fitted, str, Input[Any] | Output[Any]]
"""A device, its name of a port, and the port as its class declares it."""


def device_class(path: str) -> type[Device]:
    """Return the device class at ``module:Class``; raises NoSuchDevice."""
    module_name, separator, class_name = path.partition(":")
    if not separator or not module_name or not class_name:
        raise NoSuchDevice(f"{path!r} must look like 'package.module:Class'")
    try:
        module = imported(module_name)
    except CannotImport as error:
        raise NoSuchDevice(f"{path!r}: {error}") from error
    found = getattr(module, class_name, None)
    if isinstance(found, type) and issubclass(found, Device):
        return found
    there = [name for name, value in vars(module).items() if isinstance(value, type) and issubclass(value, Device)]
    raise NoSuchDevice(f"{path!r} is no subclass of Device; {instead_of(class_name, there, none='there is none')}")


def fitted(robots: Sequence[RobotSpec]) -> list[Fitted]:
    """Return all devices of all robots; raises ParameterError with everything that is wrong."""
    devices: list[Fitted] = []
    problems: list[tuple[str, str]] = []
    for number, robot in enumerate(robots):
        for index, spec in enumerate(robot.devices):
            place = f"robots.{number}.devices.{index}"
            try:
                found = Fitted(robot, spec, device_class(spec.cls), place)
            except NoSuchDevice as error:
                problems.append((f"{place}.class", str(error)))
                continue
            devices.append(found)
            problems += _misnamed(found, "parameters", spec.parameters, found.declared.parameters)
            ports = {**found.declared.inputs, **found.declared.outputs}
            problems += _misnamed(found, "connect", spec.connections, ports)
    if problems:
        raise ParameterError(problems)
    return devices


def place_of(robots: Sequence[RobotSpec], robot: str, device: str) -> str:
    """Return where a list of robots has a device."""
    number = next(n for n, each in enumerate(robots) if each.name == robot)
    index = next(n for n, spec in enumerate(robots[number].devices) if spec.name == device)
    return f"robots.{number}.devices.{index}"


def _misnamed(
    device: Fitted, field: str, given: Mapping[str, object], known: Mapping[str, object]
) -> Iterator[tuple[str, str]]:
    kind = device.cls.__name__
    for name in given:
        if name not in known:
            what = "parameter" if field == "parameters" else "port"
            yield f"{device.place}.{field}.{name}", f"{kind} has no such {what}; {instead_of(name, known)}"


def parameters_of(robots: Sequence[RobotSpec]) -> Iterator[Parameter[Any]]:
    """Yield the parameters that devices bring to their world; raises ParameterError with everything that is wrong."""
    problems: list[tuple[str, str]] = []
    names: set[str] = set()
    for device in fitted(robots):
        given = device.spec.parameters
        try:
            fitting = limited(device.declared.parameters, given)
        except BadType as error:
            problems.append((f"{device.place}.class", str(error)))
            continue
        except ParameterError as error:
            problems += [(f"{device.place}.parameters.{short}", why) for short, why in error.parts]
            continue
        for short, parameter in device.declared.parameters.items():
            name = device.parameter(short)
            if name in names:
                problems.append((f"{device.place}.name", f"another device has a parameter {name!r}: rename one"))
            names.add(name)
            try:
                value = fitting[short].checked(given[short]) if short in given else parameter.default
            except ParameterError as error:
                problems += [(f"{device.place}.parameters.{short}", why) for _, why in error.parts]
            else:
                limit = device.parameter(parameter.limit) if parameter.limit else ""
                yield parameter.renamed(name, value, limit)
    if problems:
        raise ParameterError(problems)


def qualities_of(robots: Sequence[RobotSpec]) -> Iterator[Quality]:
    """Yield the qualities that devices declare, by their names in the world."""
    for device in fitted(robots):
        for short, quality in device.declared.qualities.items():
            yield quality.renamed(device.parameter(short))


def ports_of(robots: Sequence[RobotSpec], handler: str) -> Iterator[Input[Any] | Output[Any]]:
    """Yield the ports that devices bring to their world: an input that several devices share is one.

    Messages that devices handle go to the world's method ``handler``, with the name of the port.

    Raises:
        ParameterError: two devices write to one port, or read it as different types.
    """
    uses: dict[str, list[Use]] = {}
    for device in fitted(robots):
        ports: dict[str, Input[Any] | Output[Any]] = {**device.declared.inputs, **device.declared.outputs}
        for short, port in ports.items():
            uses.setdefault(device.port(short), []).append((device, short, port))
    problems = [problem for name, of_port in uses.items() for problem in _clashes(name, of_port)]
    if problems:
        raise ParameterError(problems)
    for name, of_port in uses.items():
        yield _world_port(name, of_port, handler)


def _clashes(name: str, uses: Sequence[Use]) -> Iterator[tuple[str, str]]:
    first, _, port = uses[0]
    takers = [(device, short) for device, short, other in uses if isinstance(other, Input) and other.keep]
    for device, short, other in uses[1:]:
        if not (isinstance(port, Input) and isinstance(other, Input) and port.message is other.message):
            why = f"the device {first.spec.name!r} has the port {name!r} already: connect one of them to another topic"
            yield f"{device.place}.connect.{short}", why
    for device, short in takers[1:]:
        taker = takers[0][0].spec.name
        why = f"the device {taker!r} takes the messages of the port {name!r}, each of them once: handle them here"
        yield f"{device.place}.connect.{short}", why


def _world_port(name: str, uses: Sequence[Use], handler: str) -> Input[Any] | Output[Any]:
    named = copy(uses[0][2])
    named.name = named.topic = name
    required_first = sorted(uses, key=lambda use: not use[2].required)
    named.origin = next(filter(None, (device.asks_for(short, port) for device, short, port in required_first)), "")
    if isinstance(named, Input):
        _suit_all(named, [port for _, _, port in uses if isinstance(port, Input)], handler)
    return named


def _suit_all(shared: Input[Any], ports: Sequence[Input[Any]], handler: str) -> None:
    """Have an input that devices share bring each of them what its own ``ports`` would."""
    shared.required = any(port.required for port in ports)
    shared.latest_only = all(port.latest_only for port in ports)
    shared.on_demand = all(port.on_demand for port in ports)
    shared.keep = max(port.keep for port in ports)
    shared.reads = tuple(dict.fromkeys(reading for port in ports for reading in port.reads))
    shared.handler_name, shared.handler_takes_name = None, True
    if any(port.handler_name for port in ports):
        shared.handler_name = handler
