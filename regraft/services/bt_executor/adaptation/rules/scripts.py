"""Decisions that are not made as long as a blackboard entry that they need holds nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from behavior_tree import BlackboardError, Node, PortError, ScriptError
from behavior_tree.script import compile_script, entries_assigned, entries_read
from behavior_tree.script.operators import truth

T = TypeVar("T")


class KnowingScript:
    """An expression in the tree's script language, of which it is known which entries it needs.

    Data that never came must not decide anything: as long as an entry is missing or empty, the value is None.
    """

    def __init__(self, text: str, node: Node) -> None:
        """Compile it for a node's blackboard; raises ValueError if it is not well-formed, or assigns."""
        enums, extensions = node.runtime.enums, node.runtime.extensions
        try:
            assigned = entries_assigned(text, extensions=extensions)
            self._names = entries_read(text, enums, extensions=extensions)
            self._script = compile_script(text, node.blackboard, enums, extensions=extensions)
        except ScriptError as error:
            raise ValueError(error.message) from None
        if assigned:
            raise ValueError(f"'{text}' assigns; compare with ==")
        self._find = node.blackboard.find

    @property
    def is_constant(self) -> bool:
        """Whether it needs no entry."""
        return not self._names

    def value(self) -> Any:
        """Return the value, None if an entry that it needs holds nothing; raises ScriptError."""
        for name in self._names:
            entry = self._find(name)
            if entry is None or entry.value is None:
                return None
        return self._script()

    def holds(self) -> bool | None:
        """Return whether it is true, None if that is unknown; raises ScriptError."""
        value = self.value()
        return None if value is None else truth(value)


def known_or_none(ask: Callable[[], T]) -> T | None:
    """Return a function's result, None if it reads a port whose entry holds nothing."""
    try:
        return ask()
    except PortError as error:
        if isinstance(error.__cause__, BlackboardError):
            return None
        raise
