"""FROG in a home of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.frog.frog import STACK, Frog

StartFrog = Callable[..., Frog]


@pytest.fixture
def start_frog(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[StartFrog]:
    """Return what starts FROG; every one is ended with the test."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    started: list[Frog] = []

    def run(*options: str, stack: Path = STACK) -> Frog:
        frog = Frog(tmp_path, *options, stack=stack)
        started.append(frog)
        return frog

    yield run
    for frog in started:
        frog.end()


@pytest.fixture
def frog(start_frog: StartFrog) -> Frog:
    """Return FROG, running as fast as it can."""
    return start_frog("--speed", "max")
