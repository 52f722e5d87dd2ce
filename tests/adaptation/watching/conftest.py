"""The looks at an adaptation that is to be confirmed."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from regraft.adaptation_manager.execution.confirmation_watch import Watch
from regraft.bus_schema.model.watched import Breach


class Looks:
    """Counts the looks that a manager has taken.

    A test does things before one of them, on the manager's thread: that look and all later ones see the whole of them.
    """

    def __init__(self) -> None:
        self.count = 0
        self._next: list[Callable[[], object]] = []
        self._last: list[Callable[[], object]] = []

    def before_the_next(self, do: Callable[[], object]) -> None:
        """Have something done before the look that comes next."""
        self._next.append(do)

    def before_the_last(self, do: Callable[[], object]) -> None:
        """Have something done before the look after which the time to confirm is over."""
        self._last.append(do)

    def begin(self, last: bool) -> None:
        """Do what is due."""
        for due in (self._next, self._last if last else []):
            while due:
                due.pop(0)()


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> Looks:
    """All looks of a test's managers."""
    taken, real = Looks(), Watch.look

    async def look(self: Watch, last: bool) -> list[Breach]:
        taken.begin(last)
        found = await real(self, last)
        taken.count += 1
        return found

    monkeypatch.setattr(Watch, "look", look)
    return taken
