"""Faults, reported when they begin, when they are over, and now and then in between."""

from __future__ import annotations

from typing import Any, Protocol

from regraft.bus_schema.messages.health import Level

RETRY_INTERVAL = 10.0
"""s after which what is still wrong is reported again."""


class Diagnose(Protocol):
    """The listener: ``Kit.diagnose``."""

    def __call__(self, subject: str, level: Level, text: str, **values: Any) -> None:
        """Put a diagnostic."""


class Troubles:
    """Keeps what is wrong with each subject, so that it is not reported with every message."""

    def __init__(self, diagnose: Diagnose) -> None:
        self._diagnose = diagnose
        self._told: dict[str, tuple[Level, float]] = {}

    def note(self, subject: str, wrong: Level | None, text: str, now: float, **values: Any) -> bool:
        """Note that a subject is ``wrong``, or well again (None), at a time (s); returns whether that is a change."""
        before = self._told.get(subject)
        if wrong is None:
            if before is None:
                return False
            del self._told[subject]
            self._diagnose(subject, Level.OK, text, **values)
            return True
        changed = before is None or before[0] is not wrong
        if before is None or changed or now - before[1] >= RETRY_INTERVAL:
            self._told[subject] = (wrong, now)
            self._diagnose(subject, wrong, text, **values)
        return changed
