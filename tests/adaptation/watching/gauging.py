"""A component that measures what it is told to, and a manager that is killed at a certain point."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from regraft import Component, Parameter, Quality
from regraft.adaptation_manager.execution.confirmation_watch import Watch
from regraft.adaptation_manager.execution.transaction import Transaction
from regraft.adaptation_manager.journal.journal import Journal
from regraft.adaptation_manager.manager import AdaptationManager


class Gauge(Component):
    """Measures what it is told to, or nothing."""

    evaluate_every = 0.05

    shown = Parameter(5.0, minimum=0.0, maximum=100.0)
    works = Parameter(True)
    wears = Parameter(0.0, "how much it shows less each second", minimum=0.0, maximum=100.0)

    level = Quality("of the water", unit="m", better="higher", minimum=0.0, maximum=10.0)
    guess = Quality("of nothing", measured=False)

    def on_activate(self) -> None:
        """Begin anew."""
        self.since = self.kit.now()

    def evaluate(self) -> dict[str, float]:
        """Return the level, NaN where it is broken."""
        level = self.shown - self.wears * (self.kit.now() - self.since)
        return {"level": max(level, 0.0) if self.works else float("nan")}


POINTS: Final[dict[str, tuple[type, str, int, bool]]] = {
    "before it notes how things are": (Watch, "begin", 1, False),
    "before its first step": (Journal, "begin", 1, False),
    "after its first step is written": (Journal, "begin", 1, True),
    "before it is confirming": (Journal, "confirming", 1, False),
    "after it is confirming": (Journal, "confirming", 1, True),
    "before it begins to watch": (Watch, "start", 1, False),
    "at its first look": (Watch, "look", 1, False),
    "at a later look": (Watch, "look", 3, True),
    "before it is withdrawn": (Transaction, "withdraw", 1, False),
    "after it is undone": (Transaction, "withdraw", 1, True),
    "before it is final": (Transaction, "settle", 1, False),
    "after it is final": (Transaction, "settle", 1, True),
}
"""The calls there: the name, how often by then, and whether it has been done."""


class DyingManager(AdaptationManager):
    """Is killed at a point of its first confirmation, once: ``died`` is a file that it leaves then."""

    point = Parameter("", choices=("", *POINTS), read_only=True)
    died = Parameter("", unit="path", read_only=True)

    def on_activate(self) -> None:
        """Prepare to be killed."""
        if self.point and not Path(self.died).exists():
            self._prepare(*POINTS[self.point])
        super().on_activate()

    def _prepare(self, cls: type, name: str, count: int, done: bool) -> None:
        real: Callable[..., Any] = getattr(cls, name)
        calls = 0

        def is_time(of: tuple[Any, ...]) -> bool:
            nonlocal calls
            report = of[1] if cls is Journal else None
            calls += report is None or report.request.confirm > 0
            return calls == count

        def die() -> None:
            Path(self.died).touch()
            os.kill(os.getpid(), signal.SIGKILL)

        async def awaited(*given: Any) -> Any:
            dies = is_time(given)
            if dies and not done:
                die()
            found = await real(*given)
            if dies:
                die()
            return found

        def called(*given: Any) -> Any:
            dies = is_time(given)
            if dies and not done:
                die()
            found = real(*given)
            if dies:
                die()
            return found

        setattr(cls, name, called if cls is Journal else awaited)
