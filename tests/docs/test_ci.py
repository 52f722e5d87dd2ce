"""`.ci/run` passes everything on one Python, and what another could break on each other one that it finds."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE

OWN = sys.version_info.minor
OTHERS = [f"3.{minor}" for minor in (11, 12, 13) if minor != OWN]


def script(path: Path, text: str) -> None:
    """Leave a program."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Return a folder in which `make` writes down what it is asked for, and no Python but the tests' own is found."""
    (tmp_path / ".ci").mkdir()
    for name in (".ci/run", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path / name)
    script(tmp_path / "bin" / "make", 'echo "$*"')
    for version in OTHERS:
        script(tmp_path / "bin" / f"python{version}", "exit 127")
    script(tmp_path / ".venv" / "bin" / "python", f'exec {sys.executable} "$@"')
    return tmp_path


def asked(clone: Path) -> list[str]:
    """Return what `make` is asked for."""
    environment = {"PATH": f"{clone / 'bin'}:/usr/bin:/bin", "PYENV_ROOT": str(clone / "pyenv")}
    done = subprocess.run(
        [clone / ".ci" / "run"], env=environment, capture_output=True, text=True, timeout=PATIENCE, check=True
    )
    return done.stdout.splitlines()


def test_one_python_passes_everything(clone: Path) -> None:
    assert asked(clone) == ["check", "test", "test-slow"]


def test_others_are_taken_from_the_path_first_and_then_from_pyenv(clone: Path) -> None:
    on_path, at_pyenv = OTHERS
    script(clone / "bin" / f"python{on_path}", "exit 0")
    script(clone / "pyenv" / "versions" / f"{on_path}.1" / "bin" / f"python{on_path}", "exit 0")
    installed = clone / "pyenv" / "versions" / f"{at_pyenv}.7" / "bin" / f"python{at_pyenv}"
    script(installed, "exit 0")
    assert asked(clone) == [
        "check",
        "test",
        "test-slow",
        f"test-python PYTHON=python{on_path}",
        f"test-python PYTHON={installed}",
    ]


def test_what_fails_ends_it(clone: Path) -> None:
    script(clone / "bin" / "make", 'echo "$*"; [ "$1" = check ]')
    with pytest.raises(subprocess.CalledProcessError) as failed:
        asked(clone)
    assert failed.value.stdout.splitlines() == ["check", "test"]
