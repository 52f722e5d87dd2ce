"""FROG in a home of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.support.frog import Frog
from tests.support.paths import FROG
from tests.support.systems import all_ended, home

StartFrog = Callable[..., Frog]


@pytest.fixture
def start_frog(tmp_path: Path) -> Iterator[StartFrog]:
    """Return what starts FROG; every one is ended with the test."""
    with home(tmp_path / "home"), all_ended(Frog.end) as started:

        def run(*options: str, stack: Path = FROG) -> Frog:
            started.append(Frog(tmp_path, *options, stack=stack))
            return started[-1]

        yield run


@pytest.fixture
def frog(start_frog: StartFrog) -> Frog:
    """Return FROG, running as fast as it can."""
    return start_frog("--speed", "max")
