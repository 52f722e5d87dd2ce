"""How a Python process of ours is started: it imports what this one does, from any current folder."""

from __future__ import annotations

import os
import sys
from pathlib import Path

INSTALLED_IN = Path(__file__).parents[2]


def own_python(*arguments: str) -> list[str]:
    """Return the command of this interpreter that does not look for modules in the current folder by itself."""
    return [sys.executable, "-P", *arguments]


def own_environment() -> dict[str, str]:
    """Return the environment for ``own_python``: this process's, and where it finds modules.

    The folder of this installation is among those. Without it, a folder named as one of our packages hides that
    package where it is installed in place: Python asks the finder of such packages last.
    """
    folders = dict.fromkeys([*(folder or os.getcwd() for folder in sys.path), str(INSTALLED_IN)])
    return {**os.environ, "PYTHONPATH": os.pathsep.join(folders)}
