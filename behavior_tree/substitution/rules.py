"""Rules that put other nodes in place of those that the XML names."""

import json
import re
from dataclasses import dataclass
from itertools import chain
from typing import Any

from ..errors import RegistryError
from .config import MockConfig, config_from_plain

Substitution = str | MockConfig
"""The replacement of a node: another registered type, or an action that does what a config states."""


@dataclass(frozen=True, slots=True)
class _Rule:
    pattern: str
    substitution: Substitution

    def matches_path(self, path: str) -> bool:
        """Return whether the pattern, with * for any text and ? for any character, fits a path."""
        first, *others = self.pattern.split("*")
        if not others:
            return len(first) == len(path) and _find(first, path, 0) == 0
        *middle, last = others
        if len(first) + len(last) > len(path) or _find(first, path[: len(first)], 0) != 0:
            return False
        # Each part is taken where it comes first: one expression for all would try every way to fit many asterisks.
        position, end = len(first), len(path) - len(last)
        for part in middle:
            found = _find(part, path[:end], position)
            if found < 0:
                return False
            position = found + len(part)
        return _find(last, path[end:], 0) == 0


def _find(part: str, path: str, start: int) -> int:
    """Return where a part of a pattern, with ? for any character, comes first in a path; -1 if nowhere."""
    found = re.compile(re.escape(part).replace(r"\?", "."), re.DOTALL).search(path, start)
    return found.start() if found else -1


class Substitutions:
    """The rules, in the order in which they were given.

    A rule's pattern is an instance name, a type ID, or a path with wildcards. If several rules fit a node, a name
    goes before a type and a type before a path; among equals the first counts. BehaviorTree.CPP leaves that open.
    """

    def __init__(self) -> None:
        self._rules: list[_Rule] = []
        self._used: set[str] = set()

    def __len__(self) -> int:
        """Return the number of rules."""
        return len(self._rules)

    def copy(self) -> "Substitutions":
        """Return rules of one's own; what is used of them counts as used of these too."""
        result = Substitutions()
        result._used = self._used
        result._rules = list(self._rules)
        return result

    def add(self, pattern: str, substitution: Substitution) -> None:
        """Add a rule."""
        self._rules.append(_Rule(pattern, substitution))

    def add_json(self, text: str) -> None:
        """Add the rules of a JSON text as BehaviorTree.CPP has them.

        ``{"TestNodeConfigs": {name: {…}}, "SubstitutionRules": {pattern: name}}``, where a name is one of the
        configs or a registered type; for the configs see `MockConfig`.

        Raises:
            RegistryError: The text is something else.
        """
        try:
            given = json.loads(text)
            if not isinstance(given, dict):
                raise ValueError("the outermost value must be an object")
            configs = {name: config_from_plain(name, plain) for name, plain in _objects(given, "TestNodeConfigs")}
            rules = _objects(given, "SubstitutionRules")
            wrong = [pattern for pattern, name in rules if not isinstance(name, str)]
            if wrong:
                raise ValueError(f"SubstitutionRules: '{wrong[0]}' must name a config or a node type")
        except (ValueError, RecursionError) as error:
            raise RegistryError(f"substitution rules: {error}") from error
        for pattern, name in rules:
            self.add(pattern, configs.get(name, name))

    @property
    def patterns(self) -> tuple[str, ...]:
        """The patterns of the rules, in their order."""
        return tuple(rule.pattern for rule in self._rules)

    @property
    def unused(self) -> tuple[str, ...]:
        """The patterns of the rules that have put nothing in any node's place."""
        return tuple(pattern for pattern in self.patterns if pattern not in self._used)

    @property
    def types(self) -> dict[str, str]:
        """The node types that rules put in a node's place, by the rules' patterns; mocks are left out."""
        return {rule.pattern: rule.substitution for rule in self._rules if isinstance(rule.substitution, str)}

    def find(self, name: str, type_ids: tuple[str, ...], path: str) -> Substitution | None:
        """Return what takes a node's place, None if it stays.

        Args:
            name: Its instance name.
            type_ids: Its type, and for a sub-tree the tree's ID too.
            path: Its path.
        """
        rule = self._fitting(name, type_ids, path)
        if rule is None:
            return None
        self._used.add(rule.pattern)
        return rule.substitution

    def _fitting(self, name: str, type_ids: tuple[str, ...], path: str) -> _Rule | None:
        by_name = (rule for rule in self._rules if rule.pattern == name)
        by_type = (rule for rule in self._rules if rule.pattern in type_ids)
        by_path = (rule for rule in self._rules if rule.matches_path(path))
        return next(chain(by_name, by_type, by_path), None)


def _objects(given: dict[str, Any], key: str) -> list[tuple[str, Any]]:
    value = given.get(key, {})
    if not isinstance(value, dict):
        raise ValueError(f"{key} must be an object")
    return list(value.items())
