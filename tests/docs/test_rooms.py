"""Files and folders stay small enough to see at a glance."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from tests.support.paths import ROOT

MAX_LINES = 400
MAX_FILES = 15
"""Modules of a folder, next to its sub-folders."""


def modules() -> list[Path]:
    """Return all modules of the project."""
    folders = ("behavior_tree", "benchmarks", "regraft", "tests")
    return [path for folder in folders for path in (ROOT / folder).rglob("*.py")]


def test_no_file_is_longer_than_a_reader_wants() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in modules()}
    assert {str(path.relative_to(ROOT)): lines for path, lines in lengths.items() if lines > MAX_LINES} == {}


def test_no_folder_has_more_files_than_a_reader_oversees() -> None:
    numbers = Counter(path.parent for path in modules() if path.name != "__init__.py")
    assert {str(path.relative_to(ROOT)): number for path, number in numbers.items() if number > MAX_FILES} == {}
