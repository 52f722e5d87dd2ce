"""How large modes are that enter other modes, all of these included: a few lines can stand for millions of changes."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

M = TypeVar("M", bound=Hashable)

MAX_CHANGES = 10_000
"""Changes and entered modes of one mode, those of the modes that it enters included."""
MAX_ALL = 100_000
"""The same, of all modes together."""
MAX_NESTING = 50
"""Modes that enter each other in turn."""


@dataclass(frozen=True, slots=True)
class ModeSize:
    """The changes and entered modes of a mode, and how many modes enter each other in turn below it."""

    changes: int
    nesting: int


def size_problems(own: Mapping[M, int], entered: Mapping[M, Sequence[M]]) -> Iterator[tuple[M, str]]:
    """Yield the modes that are too large, and why; ``own`` is how many changes of its own each has.

    Modes that enter themselves count in part: that is another problem.
    """
    total = 0
    for mode, size in _sizes(own, entered).items():
        if size.nesting > MAX_NESTING:
            yield mode, f"enters modes that enter others, {size.nesting} deep; it may be {MAX_NESTING}"
        elif size.changes > MAX_CHANGES:
            yield mode, f"has {size.changes} changes with those of the modes that it enters; it may have {MAX_CHANGES}"
        elif total + size.changes > MAX_ALL:
            yield mode, f"is too much: with what they enter, all modes may have {MAX_ALL} changes"
        else:
            total += size.changes


def _sizes(own: Mapping[M, int], entered: Mapping[M, Sequence[M]]) -> dict[M, ModeSize]:
    found: dict[M, ModeSize] = {}
    for mode in own:
        under_way = dict.fromkeys([] if mode in found else [mode])
        while under_way:
            last = next(reversed(under_way))
            inner = [each for each in entered.get(last, ()) if each in own]
            further = next((each for each in inner if each not in found and each not in under_way), None)
            if further is not None:
                under_way[further] = None
                continue
            sizes = [found[each] for each in inner if each in found]
            changes = own[last] + sum(1 + size.changes for size in sizes)
            found[last] = ModeSize(changes, max((1 + size.nesting for size in sizes), default=0))
            del under_way[last]
    return found
