"""Reads a file of skills with all that it imports, and checks it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.checks.every import check
from regraft.adaptation_manager.planners.metacontrol.skills.checks.in_stack import check_in
from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import (
    Code,
    Diagnostic,
    Findings,
    SkillsError,
)
from regraft.adaptation_manager.planners.metacontrol.skills.language.building import Lines, model_of
from regraft.adaptation_manager.planners.metacontrol.skills.language.grammar import (
    MAX_TOKENS,
    SyntaxMistake,
    token_count,
)
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import (
    Name,
    Place,
    SkillFile,
    SkillSet,
    combined,
)
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.suggestions import instead_of

LIBRARY: Final = Path(__file__).with_name("library")
SUFFIXES: Final = (".skills", ".mros")
MAX_FILE_SIZE: Final = 1024 * 1024
MAX_FILES: Final = 32
"""Files that are read for one: itself and its imports."""


@dataclass(frozen=True, slots=True)
class CheckedSkills:
    """The content of a file, and all that is wrong with it. A part that could not be read is missing."""

    skills: SkillSet
    diagnostics: tuple[Diagnostic, ...]


def read_skills(file: Path) -> SkillSet:
    """Return the skills of a file with its imports; raises SkillsError with all that is wrong."""
    checked = checked_skills(file)
    findings = Findings(list(checked.diagnostics))
    if findings.has_errors:
        raise SkillsError(checked.diagnostics)
    return checked.skills


def checked_skills(
    file: Path,
    architecture: Architecture | None = None,
    scope: str = "",
    *,
    text: str | None = None,
    max_tokens: int = MAX_TOKENS,
) -> CheckedSkills:
    """Return the skills of a file with its imports, and all that is wrong. It raises nothing.

    With an architecture, its components and their parameters are compared, too: those of the robot ``scope`` if one is
    given. ``text`` is what an editor has of the file, on disk or not; imports are read from disk. ``max_tokens`` bounds
    the words and marks of all files together.
    """
    findings = Findings()
    reader = _Reader(findings, text, max_tokens)
    reader.read_all(file)
    skills = combined(str(file), tuple(reversed(reader.files.values())))
    if not findings.has_errors:
        check(skills, findings)
        if architecture is not None:
            check_in(skills, architecture, scope, findings)
    return CheckedSkills(skills, findings.in_order())


def checked_text(text: str, file: str = "text.skills") -> CheckedSkills:
    """Return the skills of a text that imports nothing, and all that is wrong with it. It raises nothing."""
    findings = Findings()
    model = _parse(text, file, findings)
    for each in model.imports if model else ():
        findings.error(each.place, Code.NO_SUCH_IMPORT, "a text without a file imports nothing")
    skills = combined(file, (model,) if model else ())
    if not findings.has_errors:
        check(skills, findings)
    return CheckedSkills(skills, findings.in_order())


class _Reader:
    """Reads files in the order in which they are named, each once; circles are found afterwards."""

    def __init__(self, findings: Findings, text: str | None, max_tokens: int) -> None:
        self.files: dict[Path, SkillFile] = {}
        self._findings = findings
        self._edited = text
        self._max_tokens = max_tokens
        self._imports: dict[Path, list[tuple[Path, Name]]] = {}

    def read_all(self, file: Path) -> None:
        waiting: list[tuple[Path, Path, Name | None]] = [(_resolved(file), file, None)]
        tokens = 0
        while waiting:
            found, shown, named = waiting.pop(0)
            if found in self.files:
                continue
            if len(self.files) >= MAX_FILES and named is not None:
                problem = f"too many files: at most {MAX_FILES}, with all imports"
                self._findings.error(named.place, Code.TOO_MANY_IMPORTS, problem)
                return
            is_edited = named is None and self._edited is not None
            text = self._edited if is_edited else _text(shown, self._findings)
            tokens += token_count(text) if text is not None else 0
            if tokens > self._max_tokens:
                problem = f"is too large: must have at most {self._max_tokens} words and marks, with all imports"
                self._findings.error(_whole(shown), Code.TOO_LARGE, problem)
                return
            model = _parse(text, str(shown), self._findings) if text is not None else None
            if model is None:
                self.files[found] = SkillFile(str(shown))
                continue
            self.files[found] = model
            waiting += self._named(found, shown, model)
        self._check_circles()

    def _named(self, found: Path, shown: Path, model: SkillFile) -> list[tuple[Path, Path, Name | None]]:
        """Return the files that a file imports, and note those that are not there."""
        further: list[tuple[Path, Path, Name | None]] = []
        if len(model.imports) >= MAX_FILES:
            problem = f"too many imports: must be less than {MAX_FILES}"
            self._findings.error(model.imports[MAX_FILES - 1].place, Code.TOO_MANY_IMPORTS, problem)
            return further
        for each in model.imports:
            target = _imported(shown, each, self._findings)
            if target is not None:
                self._imports.setdefault(found, []).append((_resolved(target), each))
                further.append((_resolved(target), target, each))
        return further

    def _check_circles(self) -> None:
        for start in self.files:
            for target, named in self._imports.get(start, ()):
                way = self._way(target, start)
                order = list(self.files)
                if way and min(map(order.index, way)) == order.index(start):
                    circle = " > ".join(each.name for each in (start, *way))
                    self._findings.error(named.place, Code.IMPORT_CIRCLE, f"imports itself: {circle}")

    def _way(self, start: Path, end: Path) -> tuple[Path, ...]:
        """Return the files by which one imports another, both included; none if it does not."""
        ways: list[tuple[Path, ...]] = [(start,)]
        seen = {start}
        while ways:
            way = ways.pop()
            if way[-1] == end:
                return way
            further = [target for target, _ in self._imports.get(way[-1], ()) if target not in seen]
            seen.update(further)
            ways += [(*way, each) for each in further]
        return ()


def _imported(file: Path, named: Name, findings: Findings) -> Path | None:
    """Return the file that an import means: from the importing file's folder, else from the library."""
    if not named.text.endswith(SUFFIXES):
        problem = f"{named.text!r}: must be a file of skills, and end in {' or '.join(SUFFIXES)}"
        findings.error(named.place, Code.NO_SUCH_IMPORT, problem)
        return None
    try:
        for path in (file.parent / named.text, LIBRARY / named.text):
            if path.exists():
                return path
        there = [path.name for folder in (file.parent, LIBRARY) for path in folder.iterdir() if path.suffix in SUFFIXES]
    except (OSError, ValueError) as error:
        problem = f"{named.text!r}: cannot be read: {getattr(error, 'strerror', None) or error}"
        findings.error(named.place, Code.NO_SUCH_IMPORT, problem)
        return None
    problem = f"there is no file {named.text!r}; {instead_of(named.text, there)}"
    findings.error(named.place, Code.NO_SUCH_IMPORT, problem)
    return None


def _resolved(file: Path) -> Path:
    try:
        return file.resolve()
    except (OSError, RuntimeError, ValueError):  # such as a circle of links: reading it reports that
        return file


def _whole(file: Path) -> Place:
    return Place(str(file), 1, 1, 1, 1)


def _text(file: Path, findings: Findings) -> str | None:
    """Return the text of a file, None if it cannot be read."""
    problem, code = "", Code.UNREADABLE
    try:
        if file.is_dir():
            problem = "is a folder, must be a file of skills"
        elif file.exists() and not file.is_file():
            problem = "is not an ordinary file"
        elif file.suffix not in SUFFIXES:
            problem = f"is no file of skills: its name must end in {' or '.join(SUFFIXES)}"
        else:
            with file.open("rb") as stream:
                data = stream.read(MAX_FILE_SIZE + 1)
            if len(data) <= MAX_FILE_SIZE:
                return data.decode("utf-8-sig")
            problem, code = f"is too large: must be at most {MAX_FILE_SIZE // 1024} KiB", Code.TOO_LARGE
    except FileNotFoundError:
        problem = "there is no such file"
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        column = error.start - (error.object.rfind(b"\n", 0, error.start) + 1) + 1
        place = Place(str(file), line, column, line, column + 1)
        text = f"is not UTF-8 text: byte 0x{error.object[error.start]:02x} does not belong there"
        findings.error(place, code, text)
        return None
    except (OSError, ValueError) as error:
        problem = f"cannot be read: {getattr(error, 'strerror', None) or error}"
    findings.error(_whole(file), code, problem)
    return None


def _parse(text: str, file: str, findings: Findings) -> SkillFile | None:
    if token_count(text) > MAX_TOKENS:
        problem = f"is too large: must have at most {MAX_TOKENS} words and marks"
        findings.error(Place(file, 1, 1, 1, 1), Code.TOO_LARGE, problem)
        return None
    try:
        return model_of(text, file)
    except SyntaxMistake as error:
        place = Lines(text, file).place(error.start, error.start + error.length)
        findings.error(place, Code.SYNTAX, str(error))
        return None
