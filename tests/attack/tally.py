"""Counts how often each case was tried, and how often what is promised held."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

Row = tuple[str, int, int]
"""A case, how often it was tried, and how often it held."""


@dataclass
class Tally:
    """The cases of one test. ``failures`` says what did not hold, and with which chance."""

    tried: Counter[str] = field(default_factory=Counter)
    held: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)

    @contextmanager
    def one(self, case: str, what: str = "") -> Iterator[None]:
        """Try a case once; a check that fails inside is noted, and the test goes on."""
        self.tried[case] += 1
        try:
            yield
        except AssertionError as error:
            self.failures.append(f"{case}, {what}: {error}")
        else:
            self.held[case] += 1

    def many(self, case: str, count: int) -> None:
        """Note that a case was tried so often, and held."""
        self.tried[case] += count
        self.held[case] += count

    def rows(self) -> list[Row]:
        """Return a row for each case."""
        return [(case, tried, self.held[case]) for case, tried in self.tried.items()]


def table(rows: list[Row]) -> list[str]:
    """Return the lines of a table of all cases, those of one name added up."""
    tried, held = Counter[str](), Counter[str]()
    for case, count, good in rows:
        tried[case] += count
        held[case] += good
    width = max((len(case) for case in tried), default=4)
    lines = [f"| {'case':{width}} | tried | held |", f"|{'-' * (width + 2)}|------:|-----:|"]
    return lines + [f"| {case:{width}} | {tried[case]:5} | {held[case]:4} |" for case in sorted(tried)]
