"""A system that ``regraft up`` runs as a process of its own, and commands to it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from typer.testing import CliRunner

from tests.cli.app import whole
from tests.support.commands import Command, in_home, run
from tests.support.waiting import wait_for

STACK = Path(__file__).parent / "stack"


class System(Command):
    """The tiny stack, up, or whatever ``command`` runs, until the block ends."""

    def __init__(
        self, home: Path, command: tuple[str, ...] = ("up", str(STACK), "--headless"), ready: str = "all "
    ) -> None:
        """Run it in ``home``; it is ready once it prints a line that begins so."""
        self.home = home
        self.joined: list[Command] = []
        self._ready = ready
        home.mkdir(exist_ok=True)
        super().__init__(*command, log=home / "up.log", cwd=STACK, environment=in_home(home))

    def __enter__(self) -> System:
        try:
            self.wait_line(self._ready)
        except AssertionError:
            self.kill()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.interrupt()
        for command in (self, *self.joined):
            command.ended()

    def join(self, *arguments: str) -> Command:
        """Have one more component join the system."""
        words = ("run", "--join", "tiny", *arguments)
        self.joined.append(Command(*words, log=self.home / "joined.log", cwd=STACK, environment=in_home(self.home)))
        return self.joined[-1]

    def ask(self, *arguments: str) -> Any:
        """Return the JSON that a command printed."""
        done = regraft(self.home, *arguments, "--json")
        assert done.returncode == 0, done.stdout + done.stderr
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


@dataclass(frozen=True, slots=True)
class Done:
    """A command that has ended."""

    returncode: int
    stdout: str
    stderr: str


def regraft(home: Path, *arguments: str) -> Done:
    """Run a command: in this process, unless it forks others."""
    if arguments[0] == "up":
        done = run(*arguments, cwd=STACK, environment=in_home(home))
        return Done(done.returncode, done.stdout, done.stderr)
    result = CliRunner().invoke(whole(), list(arguments), env={"REGRAFT_HOME": str(home), "REGRAFT_SYSTEM": None})
    return Done(result.exit_code, result.stdout, result.stderr)
