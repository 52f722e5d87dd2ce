"""Whose a mode is: a component's, a robot's, a subsystem's, or that of the whole system."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from enum import Enum

from regraft.bus_schema.model.robots.scopes import scope_of

SYSTEM = ""
"""The part that is the whole system."""
DEFAULT = "__DEFAULT__"
"""The mode of a part that is inferred before others, as in ROS 2's system_modes."""


class PartKind(Enum):
    """The kinds of parts of which modes are."""

    COMPONENT = "component"
    ROBOT = "robot"
    SUBSYSTEM = "subsystem"
    SYSTEM = "system"


def part_of(mode: str) -> str:
    """Return the part that a mode is of, with dots.

    >>> part_of("laser.slow"), part_of("rescuer/laser.slow"), part_of("rescuer/night"), part_of("night")
    ('laser', 'rescuer.laser', 'rescuer', '')
    """
    scope, _, name = mode.rpartition("/")
    owner = name.rpartition(".")[0]
    return ".".join(filter(None, (*scope.split("/"), owner)))


def kind_of(part: str, components: Collection[str], scopes: Collection[str]) -> PartKind:
    """Return what a part is."""
    if part == SYSTEM:
        return PartKind.SYSTEM
    if part in components:
        return PartKind.COMPONENT
    is_robot = any(scope_of(name, scopes) == part for name in components)
    return PartKind.ROBOT if is_robot else PartKind.SUBSYSTEM


def modes_by_part(modes: Collection[str]) -> dict[str, list[str]]:
    """Return the modes of each part, in their order."""
    found: dict[str, list[str]] = {}
    for mode in modes:
        found.setdefault(part_of(mode), []).append(mode)
    return found


def way_between(start: str, end: str, parts: Mapping[str, Collection[str]]) -> tuple[str, ...] | None:
    """Return the modes by which one mode enters another, both included; None if it does not."""
    outer = {start: ""}
    reached = [start]
    while reached:
        last = reached.pop()
        if last == end:
            way = [last]
            while way[-1] != start:
                way.append(outer[way[-1]])
            return tuple(reversed(way))
        further = [inner for inner in parts.get(last, ()) if inner not in outer]
        outer |= dict.fromkeys(further, last)
        reached += further
    return None


def entered_with(mode: str, parts: Mapping[str, Collection[str]]) -> Iterator[str]:
    """Yield a mode and those of other parts that it enters, the outer ones first; ``parts`` has no circle."""
    yield mode
    for inner in parts.get(mode, ()):
        yield from entered_with(inner, parts)


def asked_after(
    asked: Mapping[str, str], modes: Collection[str], parts: Mapping[str, Collection[str]]
) -> dict[str, str]:
    """Return the modes that are asked for, by part, after ``modes`` were entered in their order."""
    found = dict(asked)
    for mode in modes:
        for each in entered_with(mode, parts):
            found[part_of(each)] = each
    return found
