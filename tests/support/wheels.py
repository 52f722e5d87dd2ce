"""Builds the project's wheel, as somebody does who installs it."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from tests.support.paths import ROOT

BOUND = 120.0
"""Seconds."""


def build_wheel(folder: Path) -> Path:
    """Build the wheel in a copy of the sources, so that nothing is left in the checkout; returns its file."""
    source = folder / "source"
    source.mkdir()
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    for name in ("behavior_tree", "regraft"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    pip = [sys.executable, "-m", "pip", "wheel", str(source), "--no-deps", "--no-build-isolation", "-w", str(folder)]
    built = subprocess.run(pip, capture_output=True, text=True, timeout=BOUND, check=False)
    assert built.returncode == 0, built.stderr
    (wheel,) = folder.glob("*.whl")
    return wheel
