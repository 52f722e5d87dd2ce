"""A system that ``regraft up`` runs as a process of its own, and commands to it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from typer.testing import CliRunner

from tests.cli.app import whole
from tests.waiting import PATIENCE, wait_for

STACK = Path(__file__).parent / "stack"
ROOT = Path(__file__).parents[2]


class System:
    """The tiny stack, up, or whatever ``command`` runs, until the block ends."""

    def __init__(
        self, home: Path, command: tuple[str, ...] = ("up", str(STACK), "--headless"), ready: str = "all "
    ) -> None:
        """Run it in ``home``; it is ready once it prints a line that begins so."""
        self.home = home
        self.lines: list[str] = []
        self.process: subprocess.Popen[str]
        self.joined: list[subprocess.Popen[str]] = []
        self._command = command
        self._ready = ready

    def __enter__(self) -> System:
        self.process = start(self.home, *self._command)
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip())
            if line.startswith(self._ready):
                return self
        raise AssertionError("never came up:\n" + "\n".join(self.lines))

    def __exit__(self, *_: object) -> None:
        self.interrupt()
        for process in (self.process, *self.joined):
            try:
                process.communicate(timeout=2 * PATIENCE)
            finally:
                process.kill()
                process.wait()

    def join(self, *arguments: str) -> subprocess.Popen[str]:
        """Have one more component join the system."""
        joined = start(self.home, "run", "--join", "tiny", *arguments, output=subprocess.DEVNULL)
        self.joined.append(joined)
        return joined

    def interrupt(self) -> None:
        """Do what Ctrl-C does."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)

    def ended(self) -> int:
        """Wait for its end; returns the exit code."""
        assert self.process.stdout is not None
        self.lines += [line.rstrip() for line in self.process.stdout]
        return self.process.wait(2 * PATIENCE)

    def ask(self, *arguments: str) -> Any:
        """Return the JSON that a command printed."""
        done = regraft(self.home, *arguments, "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def components(self) -> dict[str, dict[str, Any]]:
        """Return what ``ps`` says of the components, by name."""
        (system,) = self.ask("ps")["systems"]
        return {component["name"]: component for component in system["components"]}

    def component_after(self, name: str, incarnation: int) -> dict[str, Any]:
        """Return a component once a later run of it than ``incarnation`` is active."""

        def found() -> dict[str, Any] | None:
            seen = self.components().get(name)
            later = seen is not None and (seen["incarnation"] or 0) > incarnation
            return seen if seen and later and seen["state"] == "active" else None

        return wait_for(found, f"{name} is active in a later run than {incarnation}")


def environment(home: Path) -> dict[str, str]:
    """Return the environment of a command."""
    kept = {name: value for name, value in os.environ.items() if name != "REGRAFT_SYSTEM"}
    return {**kept, "REGRAFT_HOME": str(home), "PYTHONPATH": str(ROOT)}


def start(
    home: Path, *arguments: str, output: int = subprocess.PIPE, errors: int = subprocess.STDOUT
) -> subprocess.Popen[str]:
    """Start a command that stays, where the tiny stack's classes are."""
    return subprocess.Popen(
        [sys.executable, "-m", "regraft.cli", *arguments],
        env=environment(home),
        stdout=output,
        stderr=errors,
        text=True,
        cwd=STACK,
    )


@dataclass(frozen=True, slots=True)
class Done:
    """A command that has ended."""

    returncode: int
    stdout: str
    stderr: str


def regraft(home: Path, *arguments: str) -> Done:
    """Run a command: in this process, unless it forks others."""
    if arguments[0] == "up":
        process = start(home, *arguments, errors=subprocess.PIPE)
        stdout, stderr = process.communicate(timeout=2 * PATIENCE)
        return Done(process.returncode, stdout, stderr)
    result = CliRunner().invoke(whole(), list(arguments), env={"REGRAFT_HOME": str(home), "REGRAFT_SYSTEM": None})
    return Done(result.exit_code, result.stdout, result.stderr)
