"""Errors of the knowledge base."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

MAX_PROBLEMS: Final = 50


@dataclass(frozen=True, slots=True, order=True)
class Problem:
    """One thing that is wrong: the file, its line (0: unknown), and why, with the individual where there is one."""

    file: str
    line: int
    why: str

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        return f"{place}: {self.why}" if place else self.why


class KnowledgeError(ValueError):
    """Files that are no knowledge base; ``problems`` has all that is wrong with them."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(dict.fromkeys(problems))
        shown = [str(problem) for problem in self.problems[:MAX_PROBLEMS]]
        if len(self.problems) > MAX_PROBLEMS:
            shown.append(f"and {len(self.problems) - MAX_PROBLEMS} more")
        super().__init__("\n".join(shown))


def fail(file: str, line: int, why: str) -> KnowledgeError:
    """Return an error with one problem."""
    return KnowledgeError([Problem(file, line, why)])
