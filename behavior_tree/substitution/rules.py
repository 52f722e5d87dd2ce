"""Rules that put other nodes in place of those that the XML names."""

import json
import re
from dataclasses import dataclass
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
        expression = re.escape(self.pattern).replace(r"\*", ".*").replace(r"\?", ".")
        return re.fullmatch(expression, path, re.DOTALL) is not None


class Substitutions:
    """The rules, in the order in which they were given.

    A rule's pattern is an instance name, a type ID, or a path with wildcards. If several rules fit a node, a name
    goes before a type and a type before a path; among equals the first counts. BehaviorTree.CPP leaves that open.
    """

    def __init__(self) -> None:
        self._rules: list[_Rule] = []

    def __len__(self) -> int:
        """Return the number of rules."""
        return len(self._rules)

    def copy(self) -> "Substitutions":
        """Return rules of one's own."""
        result = Substitutions()
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

    def find(self, name: str, type_ids: tuple[str, ...], path: str) -> Substitution | None:
        """Return what takes a node's place, None if it stays.

        Args:
            name: Its instance name.
            type_ids: Its type, and for a sub-tree the tree's ID too.
            path: Its path.
        """
        for rule in self._rules:
            if rule.pattern == name:
                return rule.substitution
        for rule in self._rules:
            if rule.pattern in type_ids:
                return rule.substitution
        for rule in self._rules:
            if rule.matches_path(path):
                return rule.substitution
        return None


def _objects(given: dict[str, Any], key: str) -> list[tuple[str, Any]]:
    value = given.get(key, {})
    if not isinstance(value, dict):
        raise ValueError(f"{key} must be an object")
    return list(value.items())
