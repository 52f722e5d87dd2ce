"""Merges a document over another: maps are merged, lists and scalars replaced, and ``null`` removes.

A file of modes stays next to a map of modes. In ``connect`` of a component ``null`` is a value: the port is
connected to no topic.
"""

from __future__ import annotations

from dataclasses import dataclass

from regraft.bus_schema.model.robots.scopes import SHARED
from regraft.bus_schema.suggestions import Hints
from regraft.stack.yaml.nodes import Node
from regraft.stack.yaml.problems import Report

MODES = "modes"


@dataclass(frozen=True, slots=True)
class Kind:
    """The entries of a section: what they are called, and which of these fields makes a new one whole."""

    name: str
    whole_with: tuple[str, ...] = ()


KINDS = {
    "components": Kind("component", ("class", "command")),
    "devices": Kind("device", ("class",)),
    "topics": Kind("topic", ("type",)),
    "parameters": Kind("parameter"),
}
FIELD = Kind("field")


def merge(base: Node, over: Node, report: Report, at: str = "", *, fixed: tuple[str, ...] = ()) -> Node:
    """Return ``base`` with the values of ``over``, at the dotted path ``at``.

    A change or removal of something that is not there is noted and left out. The sections ``fixed`` get no new entries.
    """
    return _Merge(report, at, fixed).merged(base, over, ())


@dataclass(frozen=True, slots=True)
class _Merge:
    report: Report
    at: str
    fixed: tuple[str, ...]

    def merged(self, base: Node, over: Node, path: tuple[str, ...]) -> Node:
        if _is_entry(path) and path[0] == "topics":
            base, over = long_form(base, "type"), long_form(over, "type")
        if path == (MODES,) and dict in (type(base.value), type(over.value)):
            base, over = long_form(base, SHARED), long_form(over, SHARED)
        if base.value is None and self._is_fixed(path):
            base = Node({}, base.location)
        if not isinstance(base.value, dict) or not isinstance(over.value, dict):
            return over
        parts, hints = dict(base.value), Hints(base.value)
        for key, part in over.value.items():
            here = (*path, key)
            if _is_connection(here):
                parts[key] = part
            elif key in parts and part.value is None:
                del parts[key]
            elif key in parts or (part.value is not None and self._is_fixed(here)):
                parts[key] = self.merged(parts.get(key, Node({}, part.location)), part, here)
            else:
                problem = self._problem(part, here)
                if problem:
                    self.report.add_at(part.location, self._shown(here), f"{problem}; {hints.instead_of(key)}")
                else:
                    parts[key] = part
        return Node(parts, base.location)

    def _is_fixed(self, path: tuple[str, ...]) -> bool:
        return len(path) == 1 and path[0] in self.fixed

    def _problem(self, part: Node, path: tuple[str, ...]) -> str:
        """Return why an entry that the base lacks cannot be new; empty if it can."""
        kind = KINDS.get(path[0], FIELD) if _is_entry(path) else FIELD
        if part.value is None:
            return f"there is no {kind.name} {path[-1]!r} to remove"
        if _is_entry(path) and path[0] in self.fixed:
            return f"there is no {kind.name} {path[-1]!r} to change"
        if kind.whole_with and isinstance(part.value, dict) and not part.value.keys() & set(kind.whole_with):
            needed = " or ".join(f"'{field}'" for field in kind.whole_with)
            return f"there is no {kind.name} {path[-1]!r} to change, and a new one needs {needed}"
        return ""

    def _shown(self, path: tuple[str, ...]) -> str:
        return ".".join((self.at, *path) if self.at else path)


def _is_entry(path: tuple[str, ...]) -> bool:
    return len(path) == 2


def _is_connection(path: tuple[str, ...]) -> bool:
    return len(path) == 4 and path[0] == "components" and path[2] == "connect"


def long_form(short: Node, field: str) -> Node:
    """Return a topic that is given by its type alone, or modes that are by their file, as a map."""
    return Node({field: short}, short.location) if isinstance(short.value, str) else short
