"""The project's command line, as processes of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

from tests.support.launcher import Process, launcher
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE, wait_for

AnyProcess = Process | subprocess.Popen[bytes]
REGRAFT = (sys.executable, "-m", "regraft.cli")


def in_home(home: Path) -> dict[str, str]:
    """Return the environment of a command that knows the systems of ``home`` alone, and runs in any folder."""
    kept = {name: value for name, value in os.environ.items() if name != "REGRAFT_SYSTEM"}
    return {**kept, "REGRAFT_HOME": str(home), "PYTHONPATH": str(ROOT)}


def run(
    *words: str,
    cwd: Path = ROOT,
    environment: Mapping[str, str] | None = None,
    program: tuple[str, ...] = REGRAFT,
    fresh: bool = False,
    within: float = 2 * PATIENCE,
    imported: str = "",
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end; ``fresh`` starts an interpreter for it, as any other ``program`` has.

    The classes of the installed stack ``imported`` need not be imported by it.
    """
    if fresh or program != REGRAFT:
        return subprocess.run(
            [*program, *words],
            cwd=cwd,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=within,
            check=False,
        )
    with TemporaryFile() as output, TemporaryFile() as errors:
        process = _fork(words, output, errors, cwd, environment, imported)
        try:
            code = process.wait(within)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            raise
        return subprocess.CompletedProcess([*program, *words], code, _content(output), _content(errors))


def _fork(
    words: tuple[str, ...],
    output: IO[bytes],
    errors: IO[bytes],
    cwd: Path,
    environment: Mapping[str, str] | None,
    imported: str,
) -> Process:
    with Path(os.devnull).open("rb") as nothing:
        streams = nothing.fileno(), output.fileno(), errors.fileno()
        return launcher(imported).fork(words, streams, cwd, os.environ if environment is None else environment)


def _content(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode()


Prepare = Callable[[], object] | None


class Command:
    """A command that runs until it is ended; what it prints goes to a log."""

    def __init__(
        self,
        *words: str,
        log: Path,
        cwd: Path = ROOT,
        environment: Mapping[str, str] | None = None,
        prepare: Prepare = None,
        imported: str = "",
    ) -> None:
        """Start it; ``prepare`` is called in its process first, which then has an interpreter of its own.

        The classes of the installed stack ``imported`` need not be imported by it.
        """
        self.log = log
        self.process: AnyProcess
        with log.open("wb") as output:
            if prepare is None:
                self.process = _fork(words, output, output, cwd, environment, imported)
                return
            self.process = subprocess.Popen(
                [*REGRAFT, *words],
                cwd=cwd,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                preexec_fn=prepare,
            )

    @property
    def lines(self) -> list[str]:
        """Its output."""
        return self.log.read_text().splitlines()

    def must_run(self) -> None:
        """Fail the test with what it has printed if it has ended."""
        if self.process.poll() is not None:
            raise AssertionError(self.log.read_text())

    def wait_line(self, start: str) -> str:
        """Return the first line that begins so, as soon as it is printed."""

        def found() -> str | None:
            over = self.process.poll() is not None
            line = next((line for line in self.lines if line.startswith(start)), None)
            assert line or not over, self.log.read_text()
            return line

        return wait_for(found, f"a line that begins with {start!r}")

    def interrupt(self) -> None:
        """Do what Ctrl-C does."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)

    def end(self) -> int:
        """Interrupt it, also where it is stopped; returns the exit code. It is killed if that takes too long."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
        self.interrupt()
        return self.ended()

    def ended(self) -> int:
        """Wait for its end; returns the exit code. It is killed if that takes too long."""
        try:
            return self.process.wait(2 * PATIENCE)
        finally:
            self.kill()

    def kill(self) -> None:
        """Kill it."""
        self.process.kill()
        self.process.wait()
