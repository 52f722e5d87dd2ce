"""One run under way: ``regraft up`` as a user would call it, in a process of its own, watched by what it writes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from regraft.evaluation.runs.run_directory import ROWS, BadRun, Plan
from regraft.process.forked import die_with_parent
from regraft.process.own_python import own_environment, own_python

STARTED_TIMEOUT: Final = 90.0
STALLED_TIMEOUT: Final = 60.0
"""Wall-clock seconds in which the first row, then each further one has to come."""
END_TIMEOUT: Final = 30.0
SAID, COMPLAINED = "up.json", "up.log"
LAST_WORDS: Final = 300


class RunProcess:
    """A run, from its start on."""

    def __init__(self, plan: Plan, home: Path, stack: Path) -> None:
        """Start it; its files are in ``home``."""
        self.plan, self.home = plan, home
        self._began = self._moved = time.monotonic()
        self._ended: float | None = None
        self._size = 0
        self._why = ""
        self._rows = home / str(plan.document().get("system", "")) / ROWS
        command = own_python("-m", "regraft.cli", "up", str(stack), "--headless", "--json", "--speed", "max")
        command += ["--seed", str(plan.seed), "--for", f"{plan.seconds:g}"]
        parent = os.getpid()
        with (home / SAID).open("w") as said, (home / COMPLAINED).open("w") as complained:
            # Interrupts of the terminal are the campaign's alone; killed, it leaves nothing behind.
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=complained,
                env={**own_environment(), "REGRAFT_HOME": str(home)},
                start_new_session=True,
                preexec_fn=lambda: die_with_parent(parent),
            )

    def is_over(self) -> bool:
        """Return whether it has ended; one that does not move any more is ended."""
        if self._process.poll() is not None:
            self._ended = self._ended or time.monotonic()
            return True
        now = time.monotonic()
        size = self._rows.stat().st_size if self._rows.is_file() else 0
        if size != self._size:
            self._size, self._moved = size, now
        within = STALLED_TIMEOUT if size else STARTED_TIMEOUT
        if now - self._moved > within:
            self._why = f"no {'further' if size else 'first'} row within {within:g} s"
            self.end()
            return True
        return False

    def simulated(self) -> float:
        """Return the simulated seconds that have been written down."""
        try:
            with self._rows.open("rb") as file:
                file.seek(max(0, self._rows.stat().st_size - 4096))
                lines = file.read().splitlines()
            return float(lines[-1].split(b",")[0])
        except (OSError, ValueError, IndexError):
            return 0.0

    def seconds(self) -> float:
        """Return how long it has taken, or took."""
        return (self._ended or time.monotonic()) - self._began

    def closing(self) -> Mapping[str, Any]:
        """Return what it printed at its end; raises BadRun if it did not come to a good one."""
        try:
            said = json.loads((self.home / SAID).read_text())
        except ValueError:
            said = {}
        code = self._process.returncode
        if self._why or code or not isinstance(said, dict) or not said:
            problems = "; ".join(said.get("problems", ())) if isinstance(said, dict) else ""
            why = self._why or problems or self._last_words() or "it printed nothing"
            raise BadRun(f"exit code {code}: {why}")
        return said

    def _last_words(self) -> str:
        lines = (self.home / COMPLAINED).read_text(errors="replace").split("\n")
        told = [line.strip() for line in lines if line.strip()]
        return told[-1][-LAST_WORDS:] if told else ""

    def end(self) -> None:
        """End it: asked first, then killed, with all that it started."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(END_TIMEOUT)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._ended = time.monotonic()
