"""Names in generated files: each is legal there, and no two things share one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Realization


class Names:
    """The names that are taken so far."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)
        self._next: dict[str, int] = {}

    def __contains__(self, name: str) -> bool:
        """Return whether a name is taken."""
        return name in self._taken

    def take(self, wanted: str) -> str:
        """Return the name, with a number behind it if it is taken."""
        name, number = wanted, self._next.get(wanted, 2)
        while name in self._taken:
            name, number = f"{wanted}_{number}", number + 1
        self._next[wanted] = number
        self._taken.add(name)
        return name


def qualified(realizations: Iterable[Realization], names: Names) -> dict[Realization, str]:
    """Return a name for each realization: its own, with its skill before it if several skills use it or it is taken."""
    every = tuple(realizations)
    uses = Counter(each.name for each in every)
    found = {}
    for each in every:
        is_own = uses[each.name] == 1 and each.name not in names
        found[each] = names.take(each.name if is_own else f"{each.skill}_{each.name}")
    return found
