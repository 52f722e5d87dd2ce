"""``regraft up`` as studies call it: a stack at full speed, in a home of its own, under the name that the stack has."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from regraft.process.own_python import own_environment, own_python

CHOSEN_SYSTEM: Final = "REGRAFT_SYSTEM"
"""The system that the user has chosen for commands, which would give a run its name."""


def up_command(stack: Path, seed: int, *options: str) -> list[str]:
    """Return the command that runs a stack."""
    command = own_python("-m", "regraft.cli", "up", str(stack), "--headless", "--json", "--speed", "max")
    return [*command, "--seed", str(seed), *options]


def up_environment(home: Path) -> dict[str, str]:
    """Return the environment of that command; ``home`` takes the run's files."""
    own = {name: value for name, value in own_environment().items() if name != CHOSEN_SYSTEM}
    return {**own, "REGRAFT_HOME": str(home)}
