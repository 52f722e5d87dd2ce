"""The names that a text may use, half-written or not: those of its last content, of its imports, and its own words."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.meaning import CONTEXTS, STATES, every_component
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY, MAX_FILES, checked_skills
from regraft.adaptation_manager.planners.metacontrol.skills.server.texts import MAX_TOKENS
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import SkillSet

IDENTIFIER: Final = r"[A-Za-z_][A-Za-z0-9_]*"
DECLARED: Final = {
    "skills": re.compile(rf"\bSkill\s+({IDENTIFIER})"),
    "qualities": re.compile(rf"\bQuality\s+({IDENTIFIER})"),
    "contexts": re.compile(rf"\bContext\s+({IDENTIFIER})"),
    "components": re.compile(r"\bComponent\s+([A-Za-z_][A-Za-z0-9_-]*(?:[./][A-Za-z_][A-Za-z0-9_-]*)*)"),
}
IMPORT: Final = re.compile(r"""\bimport\s+["']([^"'\n]+)["']""")


@dataclass(slots=True)
class Names:
    """Names by kind, each once, in the order in which they were found."""

    skills: dict[str, None] = field(default_factory=dict)
    qualities: dict[str, None] = field(default_factory=dict)
    contexts: dict[str, None] = field(default_factory=dict)
    components: dict[str, None] = field(default_factory=dict)
    configurations: dict[str, dict[str, None]] = field(default_factory=dict)
    parameters: dict[str, dict[str, None]] = field(default_factory=dict)

    def add(self, skills: SkillSet) -> None:
        """Add the names of skills that were read."""
        self.skills.update(_keys(each.name for each in skills.skills))
        self.qualities.update(_keys(each.name for each in skills.qualities))
        self.qualities.update(_keys(each.text for one in skills.skills for each in one.qualities))
        self.contexts.update(_keys(each.text for each in skills.contexts))
        for component in every_component(skills):
            self.components[component.name] = None
            modes = self.configurations.setdefault(component.name, {})
            known = self.parameters.setdefault(component.name, {})
            for each in component.configurations:
                modes[each.name] = None
                known.update(_keys(one.name for one in each.parameters or ()))

    def of_component(self, component: str) -> Iterator[str]:
        """Yield the configurations that a component has somewhere, then the lifecycle states."""
        yield from dict.fromkeys((*self.configurations.get(component, {}), *STATES))


def names_in(text: str, path: Path, known: SkillSet | None) -> Names:
    """Return the names that a text may use."""
    found = Names(contexts=_keys(CONTEXTS))
    if known is not None:
        found.add(known)
    if known is None or len(known.files) < 2:  # a text that could not be read so far has no imports either
        for file in _imports(text, path):
            found.add(checked_skills(file, max_tokens=MAX_TOKENS).skills)
    for kind in ("skills", "qualities", "contexts", "components"):
        getattr(found, kind).update(_keys(each[1] for each in DECLARED[kind].finditer(text)))
    return found


def _imports(text: str, path: Path) -> Iterator[Path]:
    """Yield the files that a text imports and that are there."""
    for number, each in enumerate(IMPORT.finditer(text)):
        if number >= MAX_FILES:
            return
        for file in (path.parent / each[1], LIBRARY / each[1]):
            try:
                if file.is_file():
                    yield file
                    break
            except (OSError, ValueError):
                continue


def _keys(names: Iterable[str]) -> dict[str, None]:
    return dict.fromkeys(names)
