"""Finds component classes and modules of message types, in the stack's folder too."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.description import Description
from regraft.bus_schema.model.parameter_values import parameter_problem
from regraft.component.component import declared, describe
from regraft.component.parameters import Parameter, ParameterError
from regraft.process.main import NoSuchClass, load_class
from regraft.process.modules import CannotImport, hidden_file, imported, line_of
from regraft.stack.relative_paths import with_absolute_paths

ROBOTS = "robots"
"""The parameter of worlds that has their robots."""


def look_in(folder: Path) -> None:
    """Let this process import the stack's own modules; they come last, so they hide nobody else's."""
    if str(folder) not in sys.path:
        sys.path.append(str(folder))


def import_problem(module: str) -> str | None:
    """Import a module; return why it cannot be, None if it was."""
    try:
        imported(module)
    except CannotImport as error:
        return str(error)
    return hidden_file(module) or None


def taken_from_robot(path: str) -> dict[str, str]:
    """Return the robot's parameter for each parameter that the class at ``module:Class`` takes from its robot.

    It is empty where there is no such class: `describe_class` reports that.
    """
    return {name: parameter.from_robot for name, parameter in parameters_at(path).items() if parameter.from_robot}


def parameters_at(path: str) -> Mapping[str, Parameter[Any]]:
    """Return the parameters that the class at ``module:Class`` declares, of a component or a robot's device.

    There are none where there is no such class: what uses it reports that.
    """
    module, _, name = path.partition(":")
    try:
        return declared(getattr(imported(module), name)).parameters
    except KeyboardInterrupt:
        raise
    # An author's class may raise anything, leaving included.
    except BaseException:
        return {}


def taken_values(component: str, cls: str, references: Mapping[str, Mapping[str, PlainValue]]) -> dict[str, PlainValue]:
    """Return the parameters that a class takes from the robot of a component, as far as this robot has them.

    ``references`` have the parameters of robots, by robot; the empty name is that of the single one.
    """
    own = references.get(component.rpartition(".")[0], {})
    return {name: own[datum] for name, datum in taken_from_robot(cls).items() if datum in own}


def device_classes(parameters: object) -> Iterator[tuple[str, str]]:
    """Yield each place in a component's parameters that names the class of a robot's device, and the class's path.

    A world imports these classes as it is described.
    """
    robots = parameters.get(ROBOTS) if isinstance(parameters, dict) else None
    for index, robot in enumerate(robots if isinstance(robots, list) else ()):
        devices = robot.get("devices") if isinstance(robot, dict) else None
        for number, device in enumerate(devices if isinstance(devices, list) else ()):
            path = device.get("class") if isinstance(device, dict) else None
            if isinstance(path, str):
                yield f"{ROBOTS}.{index}.devices.{number}.class", path


def describe_class(
    path: str, parameters: Mapping[str, PlainValue], folders: Mapping[str, Path] | None = None
) -> tuple[Description, tuple[tuple[str, str], ...]]:
    """Return the description of the class at ``module:Class``, given the parameters that are read-only.

    ``folders`` are those from which relative paths are looked for. The second part has the problems that no description
    shows: each part of a parameter, and why. The description is then the one without parameters.

    Raises:
        NoSuchClass: there is none, or it cannot be described.
    """
    try:
        cls = load_class(path)
        plain = describe(cls)
        fixed = [parameter for parameter in plain.parameters if parameter.read_only and parameter.name in parameters]
        if any(parameter_problem(parameter, parameters[parameter.name]) for parameter in fixed):
            return plain, ()
        try:
            given = {parameter.name: parameters[parameter.name] for parameter in fixed}
            found = describe(cls, with_absolute_paths(plain, given, folders or {}))
            # Those that the parameters bring may be limits of others.
            new = parameters.keys() - given.keys()
            further = [parameter for parameter in found.parameters if parameter.read_only and parameter.name in new]
            if not further or any(parameter_problem(each, parameters[each.name]) for each in further):
                return found, ()
            given |= {parameter.name: parameters[parameter.name] for parameter in further}
            return describe(cls, with_absolute_paths(found, given, folders or {})), ()
        except ParameterError as error:
            return plain, error.parts
    except (NoSuchClass, KeyboardInterrupt):
        raise
    # An author's class may raise anything, leaving included.
    except BaseException as error:
        raise NoSuchClass(f"{path!r} cannot be described: {type(error).__name__}: {line_of(error)}") from None
