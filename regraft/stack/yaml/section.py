"""Reads the fields of one map of a stack file, noting everything that is not as it must be."""

from __future__ import annotations

import math
from collections.abc import Iterable
from enum import Enum
from typing import Any, TypeVar

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.former_names import present_name
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.yaml.nodes import Location, Node, plain
from regraft.stack.yaml.problems import Report

E = TypeVar("E", bound=Enum)


class Section:
    """A map at a dotted path. A field that is absent, or wrong and noted, is its default."""

    def __init__(self, node: Node, path: str, report: Report) -> None:
        """Note it if the node is no map; it is then read as an empty one."""
        self.path = path
        self.report = report
        self._parts: dict[str, Node] = {}
        if isinstance(node.value, dict):
            self._parts = node.value
        elif node.value is not None or not path:
            report.add(path, f"must be a map, is {node.kind}")

    def __contains__(self, key: str) -> bool:
        """Return whether the field is given."""
        return key in self._parts

    def names(self) -> tuple[str, ...]:
        """Return all fields that are given."""
        return tuple(self._parts)

    def at(self, key: str) -> str:
        """Return the dotted path of a field."""
        return f"{self.path}.{key}" if self.path else key

    def wrong(self, key: str, problem: str) -> None:
        """Note a problem of a field."""
        self.report.add(self.at(key), problem)

    def only(self, *known: str) -> None:
        """Note every field that is not one of ``known``."""
        for key in self._parts:
            if key not in known:
                present = present_name(key, known)
                meant = instead_of(key, known) if present is None else f"it is called {present!r}"
                self.wrong(key, f"there is no such field; {meant}")

    def node(self, key: str) -> Node | None:
        """Return a field as it is."""
        return self._parts.get(key)

    def location(self, key: str) -> Location:
        """Return the place of a field."""
        node = self._parts.get(key)
        return node.location if node else self.report.location_of(self.at(key))

    def text(self, key: str, default: str = "") -> str:
        """Return a text, which must not be empty."""
        node = self._parts.get(key)
        if node is None:
            return default
        if isinstance(node.value, str) and node.value:
            return node.value
        number = isinstance(node.value, int | float)
        hint = f": put it in quotes, '{plain(node)}'" if number else ""
        self.wrong(key, f"must be a text, is {node.kind if node.value != '' else 'empty'}{hint}")
        return default

    def expression(self, key: str) -> str:
        """Return the text of an expression, which may be written as a number or truth value; empty by default."""
        node = self._parts.get(key)
        return str(node.value) if node is not None and isinstance(node.value, int | float) else self.text(key)

    def flag(self, key: str, default: bool) -> bool:
        """Return true or false."""
        node = self._parts.get(key)
        if node is None or isinstance(node.value, bool):
            return bool(node.value) if node else default
        self.wrong(key, f"must be true or false, is {plain(node)!r}")
        return default

    def number(self, key: str, minimum: float | None = None, maximum: float | None = None) -> float | None:
        """Return a finite number, None by default."""
        node = self._parts.get(key)
        if node is None:
            return None
        value = node.value
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.wrong(key, f"must be a number, is {node.kind}")
        elif isinstance(value, float) and not math.isfinite(value):
            self.wrong(key, "must be finite")
        elif minimum is not None and value < minimum:
            self.wrong(key, f"{value}: must be at least {minimum:g}")
        elif maximum is not None and value > maximum:
            self.wrong(key, f"{value}: must be at most {maximum:g}")
        else:
            return float(value)
        return None

    def integer(self, key: str, default: int, minimum: int, maximum: int) -> int:
        """Return a whole number within bounds."""
        node = self._parts.get(key)
        if node is None:
            return default
        value = node.value
        # A number that is too long to be read exactly is a float: "too large" is the better message.
        if isinstance(value, float) and abs(value) > max(abs(minimum), maximum):
            self.wrong(key, f"{value:g}: must be from {minimum} to {maximum}")
        elif isinstance(value, bool) or not isinstance(value, int):
            self.wrong(key, f"must be a whole number, is {plain(node)!r}")
        elif not minimum <= value <= maximum:
            self.wrong(key, f"{value}: must be from {minimum} to {maximum}")
        else:
            return value
        return default

    def choice(self, key: str, choices: Iterable[E], default: E) -> E:
        """Return the member of ``choices`` whose value is given."""
        node = self._parts.get(key)
        if node is None:
            return default
        named: dict[Any, E] = {choice.value: choice for choice in choices}
        if isinstance(node.value, str) and node.value in named:
            return named[node.value]
        self.wrong(key, f"must be one of: {', '.join(named)}; is {plain(node)!r}")
        return default

    def section(self, key: str) -> Section:
        """Return a map, empty by default."""
        return Section(self._parts.get(key) or Node({}), self.at(key), self.report)

    def texts(self, key: str) -> tuple[str, ...]:
        """Return a list of texts, empty by default."""
        node = self._parts.get(key)
        if node is None:
            return ()
        if not isinstance(node.value, tuple):
            self.wrong(key, f"must be a list, is {node.kind}")
            return ()
        items = Section(Node({str(i): part for i, part in enumerate(node.value)}), self.at(key), self.report)
        return tuple(filter(None, (items.text(item) for item in items.names())))

    def command(self, key: str) -> tuple[str, ...]:
        """Return a program and its arguments, which may be empty; a number that a reference has stands as a text."""
        node = self._parts.get(key)
        if node is None or not isinstance(node.value, tuple):
            return self.texts(key)
        items = Section(Node({str(i): part for i, part in enumerate(node.value)}), self.at(key), self.report)
        return tuple(items._argument(item) for item in items.names())

    def _argument(self, item: str) -> str:
        part = self._parts[item]
        is_number = isinstance(part.value, int | float) and not isinstance(part.value, bool)
        if part.referred and is_number:
            return str(part.value)
        return "" if part.value == "" and item != "0" else self.text(item)

    def distinct(self, key: str) -> tuple[str, ...]:
        """Return a list of texts of which none is given twice, empty by default."""
        found = self.texts(key)
        for index, text in enumerate(found):
            if text in found[:index]:
                self.wrong(f"{key}.{index}", f"{text!r} is given twice: leave one out")
        return found

    def text_map(self, key: str) -> dict[str, str]:
        """Return a map of texts, empty by default."""
        inner = self.section(key)
        texts = {name: inner.text(name) for name in inner.names()}
        return {name: text for name, text in texts.items() if text}

    def optional_text_map(self, key: str) -> dict[str, str | None]:
        """Return a map of texts, some of which may be null; empty by default."""
        inner = self.section(key)
        nothing = {name: None for name, part in inner._parts.items() if part.value is None}
        texts = {name: inner.text(name) for name in inner.names() if name not in nothing}
        return {name: text for name, text in {**texts, **nothing}.items() if text != ""}

    def plain_map(self, key: str) -> dict[str, PlainValue]:
        """Return a map of any values, empty by default."""
        inner = self.section(key)
        return {name: plain(part) for name, part in inner._parts.items()}
