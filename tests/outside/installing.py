"""Somebody else's package, installed the ordinary way, and the commands of a user who has it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.commands import Command, run
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE


def installed_package(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install a package into a folder of its own, and return the folder."""
    copy = tmp_path_factory.mktemp("source") / "package"
    target = tmp_path_factory.mktemp("installed")
    subprocess.run(["cp", "-r", str(source), str(copy)], check=True)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*pip, "--target", str(target), str(copy)], check=True, timeout=4 * PATIENCE)
    return target


def having(installed: Path, home: Path) -> dict[str, str]:
    """Return the environment of a user who has the package."""
    path = os.pathsep.join([str(installed), str(ROOT)])
    return {**os.environ, "PYTHONPATH": path, "REGRAFT_HOME": str(home)}


def regraft(environment: dict[str, str], *words: str, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    return run(*words, environment=environment, cwd=cwd, imported="frog")


def started(environment: dict[str, str], *words: str, log: Path, cwd: Path = ROOT) -> Command:
    """Start a command that runs until it is interrupted."""
    return Command(*words, log=log, cwd=cwd, environment=environment, imported="frog")
