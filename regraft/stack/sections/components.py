"""Reads the components of a stack file."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

from regraft.bus_schema.annotations import Connections, PlainValue
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, scopes_in
from regraft.bus_schema.model.description import Description
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.robots.scopes import in_scope, scope_of, service_in_scope
from regraft.bus_schema.model.system_topics import SYSTEM_TOPICS
from regraft.process.main import NoSuchClass
from regraft.stack.classes import describe_class, device_classes
from regraft.stack.relative_paths import with_absolute_paths, with_run_folder
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


def read_component(table: Section, name: str, refused: Collection[str] = ()) -> ComponentSpec:
    """Return one component, without its connections and services; without description where it has no class.

    Modules that are ``refused`` are not imported; why is noted already.
    """
    section = table.section(name)
    given = section.section("parameters")
    parameters = section.plain_map("parameters")
    folders = {parameter: given.location(parameter).folder for parameter in given.names()}
    description: Description | None
    if "command" in section:
        section.only(*OF_PROGRAMS)
        description = read_program(section)
    else:
        section.only(*OF_CLASSES)
        description = _class_description(section, parameters, folders, refused)
    return ComponentSpec(
        name=name,
        cls=section.text("class") if "command" not in section else "",
        command=section.command("command"),
        host=section.text("host", "local"),
        parameters=with_absolute_paths(description, parameters, folders) if description else parameters,
        state=section.choice("state", WANTED_STATES, State.ACTIVE),
        restart=read_restart(section),
        managed=section.flag("managed", True) if "command" in section else True,
        description=description,
        limits=read_limits(section),
    )


def read_connections(table: Section, spec: ComponentSpec, architecture: Architecture) -> Connections:
    """Return the topic of every port: the one that ``connect`` names, or the port's own.

    An optional input or output stays unconnected where the stack has no topic of its name, or names none.
    """
    return connections(spec, architecture, table.section(spec.name).optional_text_map("connect"))


def connections(spec: ComponentSpec, architecture: Architecture, given: Mapping[str, str | None]) -> Connections:
    """Return the topic of every port: the given one, or its own if it has to have one or the system has that topic.

    A port that a parameter asks for has to have one: it was meant. Its own topic is one of the component's scope. A
    robot without topics has the topics of all.
    """
    scope = scope_of(spec.name, scopes_in(architecture.topics)) if "." in spec.name else ""
    ports = spec.description.ports if spec.description else ()
    own = {port.name: (in_scope(scope, port.topic), port.required or bool(port.origin)) for port in ports}
    known = {*architecture.topics, *SYSTEM_TOPICS}
    return {**{port: topic for port, (topic, needed) in own.items() if needed or topic in known}, **given}


def read_services(table: Section, spec: ComponentSpec, architecture: Architecture) -> dict[str, str]:
    """Return the name under which every service is offered: the one that ``services`` has, or its own."""
    return services(spec, architecture, table.section(spec.name).text_map("services"))


def services(spec: ComponentSpec, architecture: Architecture, given: Mapping[str, str]) -> dict[str, str]:
    """Return the name under which every service is offered: the given one, or its own in the component's scope."""
    scope = scope_of(spec.name, architecture.scopes) if "." in spec.name else ""
    offered = spec.description.services if spec.description else ()
    return {service.name: service_in_scope(spec.name, scope, service.name) for service in offered} | dict(given)


def in_run_folder(spec: ComponentSpec, folder: str) -> ComponentSpec:
    """Return the spec with parameters that begin with ``$RUN`` in the folder of the running system."""
    return replace(spec, parameters=with_run_folder(spec.parameters, folder))


def _class_description(
    section: Section,
    parameters: Mapping[str, PlainValue],
    folders: Mapping[str, Path],
    refused: Collection[str],
) -> Description | None:
    path = section.text("class")
    if "class" not in section:
        section.report.add(section.path, "must have 'class' (module:Class) or 'command', has neither")
    classes = [path, *(of_device for _, of_device in device_classes(parameters))]
    if not path or any(cls.partition(":")[0] in refused for cls in classes):
        return None
    try:
        description, problems = describe_class(path, parameters, folders)
        for place, problem in problems:
            section.wrong(f"parameters.{place}", problem)
        return description
    except NoSuchClass as error:
        section.wrong("class", str(error))
        return None
