"""How two architectures differ, field by field."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from regraft.bus_schema.annotations import Count, PlainValue
from regraft.bus_schema.model.architecture import Architecture
from regraft.client.json_view import as_json

ABSENT = object()
OWN_FIELDS = ("revision", "unconfirmed")


@dataclass(frozen=True, slots=True)
class Difference:
    """One field that differs: its path (JSON Pointer, RFC 6901); ``added``, ``removed`` or ``changed``; both values."""

    path: str
    kind: str
    before: PlainValue = None
    after: PlainValue = None


@dataclass(frozen=True, slots=True)
class ArchitectureDiff:
    """The changes between two revisions."""

    before: Count
    after: Count
    differences: tuple[Difference, ...]


def diff(before: Architecture, after: Architecture) -> ArchitectureDiff:
    """Return every difference between two architectures, by path."""
    old, new = (_without(as_json(architecture)) for architecture in (before, after))
    return ArchitectureDiff(before.revision, after.revision, tuple(_differences((), old, new)))


def _pointer(path: tuple[str, ...]) -> str:
    return "".join("/" + part.replace("~", "~0").replace("/", "~1") for part in path)


def _without(plain: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in plain.items() if name not in OWN_FIELDS}


def _differences(path: tuple[str, ...], before: Any, after: Any) -> Iterator[Difference]:
    if before is ABSENT:
        yield Difference(_pointer(path), "added", after=after)
    elif after is ABSENT:
        yield Difference(_pointer(path), "removed", before=before)
    elif isinstance(before, dict) and isinstance(after, dict):
        for name in sorted(before.keys() | after.keys()):
            yield from _differences((*path, name), before.get(name, ABSENT), after.get(name, ABSENT))
    elif before != after or type(before) is not type(after):
        yield Difference(_pointer(path), "changed", before, after)
