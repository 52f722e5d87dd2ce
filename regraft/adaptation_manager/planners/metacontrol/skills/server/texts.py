"""The texts that an editor has open: what each holds, checked once, and the last content of each that could be read."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code
from regraft.adaptation_manager.planners.metacontrol.skills.reading import CheckedSkills, checked_skills
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet

MAX_TOKENS: Final = 40_000
"""Words and marks that are checked while they are edited, imports included: some 2 s. Files may have more."""
MAX_CHARACTERS: Final = 1024 * 1024
"""Characters that are looked at: the size of a file."""
MAX_OPEN: Final = 200
UNREAD: Final = frozenset({Code.SYNTAX, Code.TOO_LARGE, Code.UNREADABLE})
"""Diagnostics of a text that has no content."""


@dataclass(frozen=True, slots=True)
class Text:
    """A text in one version. ``checked`` is what it holds, ``known`` the last content that could be read."""

    path: Path
    version: int
    text: str
    checked: CheckedSkills
    known: SkillSet


class Texts:
    """The open texts, by URI. Several threads may ask; each version is checked once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._given: dict[str, tuple[Path, int, str]] = {}
        self._texts: dict[str, Text] = {}

    def set(self, uri: str, path: Path, version: int, text: str) -> None:
        """Set the present content of a text."""
        with self._lock:
            self._given[uri] = (path, version, text)
            while len(self._given) > MAX_OPEN:
                oldest = next(iter(self._given))
                del self._given[oldest]
                self._texts.pop(oldest, None)

    def remove(self, uri: str) -> None:
        """Forget a text that was closed."""
        with self._lock:
            self._given.pop(uri, None)
            self._texts.pop(uri, None)

    def content(self, uri: str) -> str:
        """Return the present content of a text, empty if it is not open."""
        with self._lock:
            return self._given[uri][2] if uri in self._given else ""

    def known(self, uri: str) -> SkillSet | None:
        """Return the last content that was read of a text, without reading it again; None if there is none."""
        with self._lock:
            return self._texts[uri].known if uri in self._texts else None

    def get(self, uri: str) -> Text | None:
        """Return a text, checked; None if it is not open."""
        with self._lock:
            if uri not in self._given:
                return None
            path, version, content = self._given[uri]
            before = self._texts.get(uri)
            if before is not None and (before.version, before.text) == (version, content):
                return before
        checked = checked_skills(path, text=content[: MAX_CHARACTERS + 1], max_tokens=MAX_TOKENS)
        is_read = not any(each.code in UNREAD and each.place.file == str(path) for each in checked.diagnostics)
        known = checked.skills if is_read or before is None else before.known
        found = Text(path, version, content, checked, known)
        with self._lock:
            if uri in self._given and self._given[uri][1] == version:
                self._texts[uri] = found
        return found
