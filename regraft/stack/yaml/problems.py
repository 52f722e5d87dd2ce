"""The problems of a stack, each with its file, line and field."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NoReturn

from regraft.stack.yaml.nodes import Location

LONGEST = 500
"""Characters of a problem that are shown: it may quote anything."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing wrong: its file (or override), line (from 1) and field, and what would be right."""

    file: str
    line: int | None
    field: str
    problem: str

    def __str__(self) -> str:
        """Return ``frog/stack.yaml:17: components.navigator.host: there is no host 'arm'``."""
        place = str(Location(self.file, self.line))
        said = self.problem if len(self.problem) <= LONGEST else f"{self.problem[:LONGEST]}…"
        return ": ".join(part for part in (place, self.field, said) if part)


MAX_SHOWN = 100


class StackError(Exception):
    """A stack that cannot run; ``problems`` has all that is wrong, by file and line, the text the first of it."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        unique = dict.fromkeys(problems)
        files = {file: number for number, file in enumerate(dict.fromkeys(problem.file for problem in unique))}
        ordered = sorted(unique, key=lambda problem: (files[problem.file], problem.line or 0))
        self.problems = tuple(ordered)
        more = [f"and {len(ordered) - MAX_SHOWN} more"] if len(ordered) > MAX_SHOWN else []
        super().__init__("\n".join([*map(str, ordered[:MAX_SHOWN]), *more]))


@dataclass(slots=True)
class Report:
    """The problems found so far in a stack of ``file``, with its fields' ``locations``."""

    file: str
    locations: dict[str, Location] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def add(self, path: str, problem: str) -> None:
        """Note a problem of the field at the dotted ``path``."""
        self.add_at(self.location_of(path), path, problem)

    def add_at(self, location: Location, path: str, problem: str) -> None:
        """Note a problem at a location."""
        self.problems.append(Problem(*location, path, problem))

    def location_of(self, path: str) -> Location:
        """Return the place of a field, or of the nearest one around it that is there."""
        return nearest(self.locations, path) or Location(self.file)

    def raise_if_any(self) -> None:
        """Raise all problems that were noted; raises StackError."""
        if self.problems:
            raise StackError(self.problems)


def fail(file: str, line: int | None, problem: str) -> NoReturn:
    """Raise the only problem; raises StackError."""
    raise StackError([Problem(file, line, "", problem)])


def nearest(locations: Mapping[str, Location], path: str) -> Location | None:
    """Return the place of the field at the dotted ``path``, or of the nearest one around it that is there."""
    while path and path not in locations:
        path = path.rpartition(".")[0]
    return locations.get(path)
