"""A system that ``regraft up`` runs as a process of its own, and commands to it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

STACK = Path(__file__).parent / "stack"
END_WITHIN = 30.0
TRIES = 60


class System:
    """The tiny stack, up, until the block ends."""

    def __init__(self, home: Path, *options: str, stack: Path = STACK) -> None:
        """Run it in ``home``."""
        self.home = home
        self.lines: list[str] = []
        self._command = ("up", str(stack), "--headless", *options)
        self.process: subprocess.Popen[str]

    def __enter__(self) -> System:
        """Start it and wait until it is up."""
        self.process = subprocess.Popen(
            [sys.executable, "-m", "regraft.cli", *self._command],
            env=environment(self.home),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip())
            if line.startswith("all "):
                return self
        raise AssertionError("never came up:\n" + "\n".join(self.lines))

    def __exit__(self, *_: object) -> None:
        """End it, by force if need be."""
        self.interrupt()
        try:
            self.ended()
        finally:
            self.process.kill()

    def interrupt(self) -> None:
        """Do what Ctrl-C does."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)

    def ended(self) -> int:
        """Wait for its end; returns the exit code."""
        rest, _ = self.process.communicate(timeout=END_WITHIN)
        self.lines += (rest or "").splitlines()
        return self.process.returncode

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
        for _ in range(TRIES):
            found = self.components()[name]
            if found["incarnation"] > incarnation and found["state"] == "active" and found["alive"]:
                return found
        raise AssertionError(f"{name} has not been restarted: {found}")


def environment(home: Path) -> dict[str, str]:
    """Return the environment of a command."""
    kept = {name: value for name, value in os.environ.items() if name != "REGRAFT_SYSTEM"}
    return {**kept, "REGRAFT_HOME": str(home), "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def regraft(home: Path, *arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command as a process of its own."""
    command = [sys.executable, "-m", "regraft.cli", *arguments]
    return subprocess.run(
        command, env=environment(home), capture_output=True, text=True, timeout=END_WITHIN, cwd=cwd, check=False
    )


def is_gone(pid: int) -> bool:
    """Tell whether a process has ended, waiting for it a little."""
    deadline = time.monotonic() + 5.0
    while time.monotonic() < deadline:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return True
        if state == "Z":
            return True
    return False
