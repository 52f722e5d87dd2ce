"""A home of its own for every test of the command line, and a tiny system that several of them share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from tests.cli.app import whole
from tests.cli.live import System


class Regraft:
    """Runs commands in this process."""

    def __call__(self, *arguments: str, text: str | None = None) -> Result:
        """Return what ``regraft ARGUMENTS`` gave."""
        return CliRunner().invoke(whole(), list(arguments), input=text)


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty home for systems."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path))
    monkeypatch.delenv("REGRAFT_SYSTEM", raising=False)
    return tmp_path


@pytest.fixture
def regraft(home: Path) -> Regraft:
    """Return the command line, in a home where nothing runs."""
    return Regraft()


@pytest.fixture(scope="module")
def tiny(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Run the tiny stack for all tests of a module."""
    with System(tmp_path_factory.mktemp("home")) as system:
        yield system
