"""Replaces ``$name`` by the value of that name, wherever it is a whole scalar."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.relative_paths import is_in_run_folder
from regraft.stack.yaml.document import DEEPEST, MAX_NODES
from regraft.stack.yaml.nodes import NOWHERE, Location, Node, size_of
from regraft.stack.yaml.problems import Report, fail

MARK = "$"
REFERENCE = re.compile(r"\$([A-Za-z_]\w*)")
ROBOT, WORLD, ROBOTS = "robot", "world", "robots"
NEVER_PARAMETERS = (ROBOT, WORLD, ROBOTS)
"""Names of references that mean the same everywhere: a robot's parameters cannot have them."""


def replaced(value: PlainValue, known: Mapping[str, PlainValue]) -> PlainValue:
    """Return a plain value with the values of ``known`` references, and ``$text`` for ``$$text``.

    Other texts stay as they are: values that a file has given already come here too, such as those of modes.
    """
    if isinstance(value, dict):
        return {key: replaced(part, known) for key, part in value.items()}
    if isinstance(value, list):
        return [replaced(part, known) for part in value]
    if not isinstance(value, str):
        return value
    if value.startswith(MARK * 2):
        return value.removeprefix(MARK)
    match = REFERENCE.fullmatch(value)
    return known.get(match[1], value) if match else value


@dataclass(slots=True)
class References:
    """The values of references in one robot, or in the stack itself.

    ``known`` are final; ``given`` are parameters, which may refer to each other. ``at`` is the dotted path around all.
    """

    report: Report
    known: dict[str, Node]
    given: Mapping[str, Node] = field(default_factory=dict)
    at: str = ""
    _chain: tuple[str, ...] = ()
    _size: int = 0

    def resolved(self, node: Node, path: str) -> Node:
        """Return a value without references; those without a value are noted, and stay.

        A value keeps the location where it was written, if it was. Raises StackError if all grows too large.
        """
        if isinstance(node.value, dict):
            parts = {key: self.resolved(part, f"{path}.{key}" if path else key) for key, part in node.value.items()}
            return Node(parts, node.location)
        if isinstance(node.value, tuple):
            items = (self.resolved(part, f"{path}.{index}") for index, part in enumerate(node.value))
            return Node(tuple(items), node.location)
        if not isinstance(node.value, str) or not node.value.startswith(MARK) or is_in_run_folder(node.value):
            return node
        if node.value.startswith(MARK * 2):
            return Node(node.value.removeprefix(MARK), node.location)
        match = REFERENCE.fullmatch(node.value)
        return self._value(node, match[1], path) if match else node

    def _value(self, node: Node, name: str, path: str) -> Node:
        if name not in self.known and name in self.given:
            if name in self._chain or len(self._chain) == DEEPEST:
                self._note_chain(node, name, path)
                return node
            before, self._chain = self._chain, (*self._chain, name)
            self.known[name] = self.resolved(self.given[name], f"parameters.{name}")
            self._chain = before
        if name not in self.known:
            self._note(node, path, self._unknown(name))
            return node
        value = self.known[name]
        self._grow(size_of(value), node.location)
        return Node(value.value, node.location if value.location is NOWHERE else value.location, referred=True)

    def _grow(self, size: int, location: Location) -> None:
        self._size += size
        if self._size > MAX_NODES:
            fail(*location, f"holds more than {MAX_NODES} values, counting what references stand for")

    def _note_chain(self, node: Node, name: str, path: str) -> None:
        chain = " > ".join(f"{MARK}{part}" for part in (*self._chain, name))
        problem = f"refers to itself: {chain}" if name in self._chain else f"refers on and on: {chain}"
        self._note(node, path, problem)

    def _note(self, node: Node, path: str, problem: str) -> None:
        self.report.add_at(node.location, f"{self.at}.{path}" if self.at else path, f"{node.value!r}: {problem}")

    def _unknown(self, name: str) -> str:
        if name == WORLD:
            return "the stack has no 'world'"
        if name == ROBOTS:
            return "the list of the robots cannot be within it"
        names = [MARK + known for known in (*self.known, *self.given)]
        own = f"a text that begins with {MARK!r} is written '{MARK * 2}{name}'"
        return f"there is no such value; {instead_of(MARK + name, names)}; {own}"
