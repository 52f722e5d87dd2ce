"""One test for a whole table: it goes through all rows and tells all that fail."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

import pytest

T = TypeVar("T")


def check_each(rows: Iterable[T], check: Callable[[T], object], name: Callable[[T], str] = str) -> None:
    """Check every row; then fail with all that do not hold, if there are any. A table without rows fails, too."""
    checked, failures = 0, []
    for row in rows:
        checked += 1
        try:
            check(row)
        except (Exception, pytest.fail.Exception) as error:
            notes = " ".join(getattr(error, "__notes__", ()))
            failures.append(f"{name(row)}: {type(error).__name__}: {error} {notes}".rstrip())
    assert checked, "the table has no rows"
    assert not failures, f"{len(failures)} of {checked}:\n" + "\n".join(failures)
