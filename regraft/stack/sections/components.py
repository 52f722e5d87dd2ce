"""Reads the components of a stack file."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.description import Description
from regraft.bus_schema.model.lifecycle import State
from regraft.process.main import NoSuchClass
from regraft.stack.classes import describe_class
from regraft.stack.sections.limits import read_limits
from regraft.stack.sections.programs import read_program
from regraft.stack.sections.restart import read_restart
from regraft.stack.yaml.section import Section

OF_CLASSES = ("class", "parameters", "connect", "services", "state", "restart", "host", "limits")
OF_PROGRAMS = (
    "command",
    "managed",
    "inputs",
    "outputs",
    "parameters",
    "connect",
    "services",
    "state",
    "restart",
    "host",
    "limits",
)

WANTED_STATES = (State.ACTIVE, State.INACTIVE, State.UNCONFIGURED)


RUN_FOLDER = "$RUN"
"""In a path parameter: the folder of the running system (``regraft.run_directory``)."""


def read_component(table: Section, name: str, folder: Path, refused: Collection[str] = ()) -> ComponentSpec:
    """Return one component, without its connections; where its class cannot be had, without description.

    Modules that are ``refused`` are not imported; why is noted already.
    """
    section = table.section(name)
    parameters = section.plain_map("parameters")
    description: Description | None
    if "command" in section:
        section.only(*OF_PROGRAMS)
        description = read_program(section)
    else:
        section.only(*OF_CLASSES)
        description = _class_description(section, parameters, refused)
    return ComponentSpec(
        name=name,
        cls=section.text("class") if "command" not in section else "",
        command=section.texts("command"),
        host=section.text("host", "local"),
        parameters=with_absolute_paths(description, parameters, folder) if description else parameters,
        services=_services(section, description),
        state=section.choice("state", WANTED_STATES, State.ACTIVE),
        restart=read_restart(section),
        managed=section.flag("managed", True) if "command" in section else True,
        description=description,
        limits=read_limits(section),
    )


def read_connections(table: Section, spec: ComponentSpec, topics: Mapping[str, TopicSpec]) -> dict[str, str]:
    """Return the topic of every port: the one that ``connect`` names, or the port's own.

    An input that needs not be fed, and an output that needs no reader, stays unconnected where the stack has no
    topic of its name.
    """
    return connections(spec.description, topics, table.section(spec.name).text_map("connect"))


def connections(
    description: Description | None, topics: Mapping[str, TopicSpec], given: Mapping[str, str]
) -> dict[str, str]:
    """Return the topic of every port: the given one, or its own if it has to have one or the stack has that topic.

    A port that a parameter asks for has to have one: it was meant.
    """
    ports = description.ports if description else ()
    own = {port.name: port.topic for port in ports if port.required or port.origin or port.topic in topics}
    return {**own, **given}


def _is_relative(value: PlainValue) -> bool:
    return isinstance(value, str) and value != "" and not value.startswith(RUN_FOLDER)


def with_absolute_paths(
    description: Description, parameters: dict[str, PlainValue], folder: Path
) -> dict[str, PlainValue]:
    """Return the parameters, those whose unit is ``path`` made absolute from ``folder``.

    Empty ones stay, and so do those that begin with ``$RUN``: the folder of the running system is not known yet.
    """
    paths = {parameter.name for parameter in description.parameters if parameter.unit == "path"}
    return {
        name: str(folder / value) if name in paths and _is_relative(value) else value
        for name, value in parameters.items()
    }


def in_run_folder(spec: ComponentSpec, folder: str) -> ComponentSpec:
    """Return the spec with parameters that begin with ``$RUN`` in the folder of the running system."""
    parameters = {
        name: value.replace(RUN_FOLDER, folder, 1) if isinstance(value, str) and value.startswith(RUN_FOLDER) else value
        for name, value in spec.parameters.items()
    }
    return replace(spec, parameters=parameters)


def _class_description(
    section: Section, parameters: Mapping[str, PlainValue], refused: Collection[str]
) -> Description | None:
    path = section.text("class")
    if "class" not in section:
        section.report.add(section.path, "must have 'class' (module:Class) or 'command', has neither")
    if not path or path.partition(":")[0] in refused:
        return None
    try:
        description, problems = describe_class(path, parameters)
        for place, problem in problems:
            section.wrong(f"parameters.{place}", problem)
        return description
    except NoSuchClass as error:
        section.wrong("class", str(error))
        return None


def _services(section: Section, description: Description | None) -> dict[str, str]:
    offered = description.services if description else ()
    return {service.name: service.name for service in offered} | section.text_map("services")
