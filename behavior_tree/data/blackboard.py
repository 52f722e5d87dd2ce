"""Blackboards: the typed, named values that the nodes of one tree share.

Every sub-tree has a board of its own. A key is looked up locally, then through the sub-tree's explicit remapping in the
parent's board. Under autoremap the same name in the parent comes last. ``@key`` always means the top board.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..clock import Clock, MonotonicClock
from ..errors import BlackboardError
from .values import UNSIGNED_MAX, Converter, PortType, to_type, type_name


@dataclass(slots=True)
class Entry:
    """One value of a blackboard.

    Attributes:
        value: The value, None while nothing has been written.
        type: The declared type, None as long as nothing fixed it.
        sequence: The number of writes so far.
        stamp: The time of the last write in seconds of the board's clock, 0 before the first.
    """

    value: Any = None
    type: PortType = None
    sequence: int = 0
    stamp: float = 0.0


class Blackboard:
    """The board of a tree or sub-tree.

    Attributes:
        parent: The board of the enclosing tree, None at the top.
        root: The top board, which ``@key`` refers to.
        clock: The source of the stamps of writes.
        converters: Functions that make values of a class from text.
    """

    def __init__(
        self,
        parent: "Blackboard | None" = None,
        *,
        remaps: Mapping[str, str] | None = None,
        autoremap: bool = False,
        clock: Clock | None = None,
        converters: Mapping[Any, Converter] | None = None,
    ) -> None:
        """Make an empty board; clock and converters are the parent's where there is one."""
        self.parent = parent
        self.root: Blackboard = parent.root if parent else self
        inherited: Mapping[Any, Converter] = parent.converters if parent else {}
        self.clock: Clock = clock or (parent.clock if parent else MonotonicClock())
        self.converters: Mapping[Any, Converter] = inherited if converters is None else converters
        self._remaps = dict(remaps or {})
        self._autoremap = autoremap
        self._entries: dict[str, Entry] = {}

    def find(self, key: str) -> Entry | None:
        """Return the entry that a key leads to, or None."""
        entry = self._entries.get(key)
        if entry is not None:
            return entry
        board, outer = self._outer(key)
        return board.find(outer) if board else None

    def get(self, key: str) -> Any:
        """Return the value of an entry.

        Raises:
            BlackboardError: There is no such entry, or nothing has been written to it yet.
        """
        entry = self.find(key)
        if entry is None:
            raise BlackboardError(f"there is no blackboard entry '{key}'")
        if entry.value is None:
            raise BlackboardError(f"blackboard entry '{key}' is empty: nothing has been written to it yet")
        return entry.value

    def set(self, key: str, value: Any, kind: PortType = None) -> None:
        """Write an entry, creating it if need be; text is converted to the entry's type.

        An entry without a type takes the value's, but new text leaves it open, as in BehaviorTree.CPP.

        Args:
            key: The entry.
            value: Its value.
            kind: The value's type where that is known more closely, as of a list's items.

        Raises:
            BlackboardError: The value does not fit the entry's type, or is None.
        """
        if value is None:
            raise BlackboardError(f"cannot write None to blackboard entry '{key}'; use unset to remove it")
        entry = self.find(key)
        if entry is None:
            entry = self.declare(key, None if isinstance(value, str) else kind or type(value))
        elif entry.type is None or (entry.type is str and not isinstance(entry.value, str)):
            entry.type = kind or type(value)
        self.store(entry, self._converted(key, value, entry.type))

    def fix_type(self, key: str) -> None:
        """Give an entry that only scripts have written the type of its value; others stay as they are."""
        entry = self.find(key)
        if entry is not None and entry.type is None and entry.value is not None:
            entry.type = type(entry.value)

    def store(self, entry: Entry, value: Any) -> None:
        """Put a value that needs no check into an entry, counting and stamping the write."""
        entry.value = value
        entry.sequence += 1
        entry.stamp = self.clock.now()

    def declare(self, key: str, kind: PortType = None) -> Entry:
        """Make sure that an entry exists, following the remappings; a new one gets a type, or stays open with None.

        As in BehaviorTree.CPP the first to name an entry decides: one that is open stays so until it is written. An
        entry that was declared as text stays text: every other port reads it, because text converts to everything.

        Raises:
            BlackboardError: The entry has another type already.
        """
        board, outer = self._outer(key)
        if key not in self._entries and board is not None:
            return board.declare(outer, kind)
        entry = self._entries.get(key)
        if entry is None:
            entry = self._entries[key] = Entry(type=kind)
        if kind is None or entry.type is None or entry.type == kind:
            return entry
        if entry.type is not str and not _related(entry.type, kind):
            known, other = type_name(entry.type), type_name(kind)
            raise BlackboardError(f"blackboard entry '{key}' is of type {known}; it cannot become {other}")
        return entry

    def set_constant(self, key: str, value: Any) -> None:
        """Put a value into this very board, hiding what a remapping would lead to; its type stays open."""
        self.store(self._entries.setdefault(key, Entry()), value)

    def unset(self, key: str) -> None:
        """Remove the entry that a key leads to, if there is one."""
        if key in self._entries:
            del self._entries[key]
            return
        board, outer = self._outer(key)
        if board is not None:
            board.unset(outer)

    def unset_own(self, key: str) -> None:
        """Remove an entry of this very board; a key that leads elsewhere is left alone."""
        self._entries.pop(key, None)

    def keys(self) -> list[str]:
        """Return the keys of this board's own entries, in order of creation."""
        return list(self._entries)

    def dump(self) -> dict[str, Any]:
        """Return this board's own entries with their values, None for empty ones."""
        return {key: entry.value for key, entry in self._entries.items()}

    def _outer(self, key: str) -> "tuple[Blackboard | None, str]":
        if key.startswith("@"):
            return self.root, key[1:]
        if self.parent is None:
            return None, key
        remapped = self._remaps.get(key)
        if remapped is not None:
            return self.parent, remapped
        if self._autoremap and not key.startswith("_"):
            return self.parent, key
        return None, key

    def _converted(self, key: str, value: Any, kind: PortType) -> Any:
        if kind is str and not isinstance(value, str):
            raise BlackboardError(f"blackboard entry '{key}' holds text, not {type(value).__name__}")
        try:
            return to_type(value, kind, self.converters)
        except ValueError as error:
            raise BlackboardError(f"blackboard entry '{key}' is of type {type_name(kind)}: {error}") from error


def _related(first: PortType, second: PortType) -> bool:
    # Whole numbers with and without sign share entries; what does not fit is refused when it is read or written.
    first, second = (int if kind in UNSIGNED_MAX else kind for kind in (first, second))
    if first is second:
        return True
    if isinstance(first, type) and isinstance(second, type) and bool not in (first, second):
        return issubclass(first, second) or issubclass(second, first)
    return False
