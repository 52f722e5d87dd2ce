"""Implausible diagnostics: which of them are reported, so that a storm of them makes no storm of events."""

from __future__ import annotations

from typing import Final

AGAIN: Final = 10.0
"""Seconds after which an implausible diagnostic is reported again."""
MAX_REPORTED: Final = 20
"""Implausible diagnostics that are reported in that time; the others are not."""
MAX_LENGTH: Final = 1000


class Doubts:
    """The implausible diagnostics that were reported lately."""

    def __init__(self) -> None:
        self._reported: dict[str, float] = {}

    def report_of(self, text: str, now: float) -> str:
        """Return what to report of a diagnostic, empty if that was reported lately, or too many were."""
        self._reported = {each: at for each, at in self._reported.items() if now - at < AGAIN}
        short = text[:MAX_LENGTH]
        if short in self._reported or len(self._reported) >= MAX_REPORTED:
            return ""
        self._reported[short] = now
        return short
