"""Reads components that are any program (``command``): the stack file describes them."""

from __future__ import annotations

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.registry import type_named
from regraft.bus_schema.model.description import Description, ParameterDescription, PortDescription
from regraft.stack.sections.topics import check_type
from regraft.stack.yaml.nodes import plain
from regraft.stack.yaml.section import Section


def read_program(section: Section) -> Description | None:
    """Return the description of a program by its ``inputs``, ``outputs`` and ``parameters`` in the file.

    Each stated port has the topic of its name by default. Each stated input must be fed.
    A parameter has the type of its value. An unmanaged program without ports has no description.
    """
    if not section.command("command"):
        section.wrong("command", "must name a program and its arguments, such as [python, -m, recorder]")
    ports = (*_ports(section, "inputs", "input"), *_ports(section, "outputs", "output"))
    names = [port.name for port in ports]
    for name in sorted({name for name in names if names.count(name) > 1}):
        section.wrong(f"outputs.{name}", "an input has this name too: each port needs a name of its own")
    managed = section.flag("managed", True)
    parameters = _parameters(section)
    if not managed and not ports and not parameters:
        return None
    return Description("", "", ports, parameters)


def _ports(section: Section, key: str, direction: str) -> list[PortDescription]:
    stated = section.section(key)
    kinds = section.text_map(key)
    return [
        PortDescription(name, direction, kind, type_named(kind).version, name)
        for name, kind in kinds.items()
        if check_type(stated, name, kind)
    ]


def _parameters(section: Section) -> tuple[ParameterDescription, ...]:
    stated = section.section("parameters")
    found = []
    for name in stated.names():
        node = stated.node(name)
        value = plain(node) if node else None
        schema = _schema(value)
        if schema:
            found.append(ParameterDescription(name, value, schema))
        else:
            stated.wrong(name, "must be true or false, a number, a text, or a list of numbers or of texts")
    return tuple(found)


def _schema(value: PlainValue) -> dict[str, PlainValue] | None:
    if isinstance(value, list):
        kinds = {_kind(part) for part in value} or {"number"}
        item = kinds.pop()
        return {"type": "array", "items": {"type": item}} if not kinds and item in ("number", "string") else None
    kind = _kind(value)
    return {"type": kind} if kind else None


def _kind(value: PlainValue) -> str | None:
    if isinstance(value, bool):
        return "boolean"
    if isinstance(value, int | float):
        return "number"
    return "string" if isinstance(value, str) else None
