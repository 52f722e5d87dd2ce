"""Reads the hosts of a stack file: their names, what they offer, and what is done when one is lost."""

from __future__ import annotations

from regraft.bus_schema import keys
from regraft.bus_schema.encoding.codec import from_plain, to_plain
from regraft.bus_schema.errors import BadKey, BadMessage
from regraft.bus_schema.model.architecture import HostRules
from regraft.bus_schema.model.description import check_amounts, check_devices
from regraft.stack.sections.limits import read_memory
from regraft.stack.yaml.nodes import plain
from regraft.stack.yaml.section import Section

FIRST = "local"
WAIT = "wait"


def read_hosts(root: Section) -> tuple[tuple[str, ...], dict[str, HostRules]]:
    """Return the names of all hosts, the first one first, and the rules of those that have any.

    ``hosts`` is a list of names, or a map from name to ``when_lost``, ``lost_after``, ``cpu``, ``memory``,
    ``devices``, ``amounts``.
    """
    node = root.node("hosts")
    if node is None:
        return (FIRST,), {}
    if not isinstance(node.value, dict):
        names = root.distinct("hosts")
        for index, name in enumerate(names):
            _check_name(root, f"hosts.{index}", name)
            if name == FIRST:
                root.wrong(f"hosts.{index}", f"{FIRST!r} is the first host, which is there without being named")
        return tuple(dict.fromkeys((FIRST, *names))), {}
    section = root.section("hosts")
    for name in section.names():
        _check_name(root, f"hosts.{name}", name)
    rules = {name: _rules(section.section(name), name) for name in section.names()}
    return tuple(dict.fromkeys((FIRST, *section.names()))), rules


def _check_name(root: Section, place: str, name: str) -> None:
    try:
        keys.host_name(name)
    except BadKey as error:
        root.wrong(place, str(error))


def _rules(section: Section, name: str) -> HostRules:
    section.only("when_lost", "lost_after", "cpu", "memory", "devices", "amounts")
    usual = HostRules()
    lost_after = section.number("lost_after")
    rules = HostRules(
        _move_to(section),
        usual.lost_after if lost_after is None else lost_after,
        section.number("cpu"),
        read_memory(section, "memory"),
        _devices(section),
        _amounts(section.section("amounts")),
    )
    if name == FIRST:
        for field in ("when_lost", "lost_after"):
            if field in section:
                section.wrong(field, "the system ends with its first host: leave it out")
    try:
        return from_plain(to_plain(rules), HostRules)
    except BadMessage as error:
        section.wrong(".".join(error.where), error.why)
        return usual


def _devices(section: Section) -> tuple[str, ...]:
    found = section.distinct("devices")
    try:
        check_devices(found)
    except BadMessage as error:
        section.wrong(".".join(error.where), error.why)
    return found


def _amounts(section: Section) -> dict[str, float]:
    found: dict[str, float] = {}
    for name in section.names():
        amount = section.number(name)
        try:
            check_amounts({name: amount or 0.0})
            found |= {name: amount} if amount is not None else {}
        except BadMessage as error:
            section.wrong(name, error.why)
    return found


def _move_to(section: Section) -> str:
    node = section.node("when_lost")
    if node is None or node.value == WAIT:
        return ""
    if isinstance(node.value, dict):
        inner = section.section("when_lost")
        inner.only("move_to")
        if "move_to" not in inner:
            inner.wrong("move_to", "is missing: must name the host on which the components are started then")
        return inner.text("move_to")
    section.wrong("when_lost", f"must be '{WAIT}' or a map {{move_to: HOST}}, is {plain(node)!r}")
    return ""
