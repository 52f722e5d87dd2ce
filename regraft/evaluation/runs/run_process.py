"""One run under way: ``regraft up`` as a user would call it, in a process of its own, watched by what it writes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any, Final

from regraft.evaluation.rows import ends_with_last_row
from regraft.evaluation.runs.attempts import FAILED, NOT_STARTED, STALLED, Cause, causes_in, error_in, told
from regraft.evaluation.runs.fingerprint import Fingerprint
from regraft.evaluation.runs.own_up import up_command, up_environment
from regraft.evaluation.runs.run_directory import ROWS, BadRun, Plan
from regraft.patience import Patience
from regraft.process.forked import die_with_parent

STARTED_TIMEOUT: Final = 90.0
STALLED_TIMEOUT: Final = 60.0
"""Wall-clock seconds in which the first row, then each further one has to come; longer on a crowded machine."""
END_TIMEOUT: Final = 30.0
SAID, COMPLAINED = "up.json", "up.log"
LAST_WORDS: Final = 300


def _stuck(has_rows: bool) -> Cause:
    if has_rows:
        return Cause(STALLED, "", f"no further row within {STALLED_TIMEOUT:g} s")
    return Cause(NOT_STARTED, "", f"no first row within {STARTED_TIMEOUT:g} s")


class RunProcess:
    """A run, from its start on."""

    def __init__(self, plan: Plan, home: Path, stack: Path, made_of: Fingerprint) -> None:
        """Start it; its files are in ``home``, and it is ``made_of`` what was there just before."""
        self.plan, self.home, self.made_of = plan, home, made_of
        self.began = datetime.now().isoformat(" ", "seconds")
        self._began = time.monotonic()
        self._moves = Patience(STARTED_TIMEOUT)
        self._ended: float | None = None
        self._size = 0
        self._stuck: Cause | None = None
        self._rows = home / plan.system / ROWS
        command = up_command(stack, plan.seed, "--for", f"{plan.seconds:g}")
        parent = os.getpid()
        with (home / SAID).open("w") as said, (home / COMPLAINED).open("w") as complained:
            # Interrupts of the terminal are the campaign's alone; killed, it leaves nothing behind.
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=complained,
                env=up_environment(home),
                start_new_session=True,
                preexec_fn=lambda: die_with_parent(parent),
            )

    def is_over(self) -> bool:
        """Return whether it has ended; one that does not move any more is ended."""
        if self._process.poll() is not None:
            self._ended = self._ended or time.monotonic()
            return True
        size = self._rows.stat().st_size if self._rows.is_file() else 0
        if size != self._size:
            self._size, self._moves = size, Patience(STALLED_TIMEOUT)
            if ends_with_last_row(self._rows):
                self.end()
                return True
        if self._moves.is_over():
            self._stuck = _stuck(size > 0)
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
        if self._stuck is not None:
            raise BadRun(self._stuck.text, [self._stuck])
        if code or not isinstance(said, dict) or not said:
            closing = said if isinstance(said, dict) else {}
            causes, complaint = causes_in(closing), self._complaint("; ".join(closing.get("problems", ())))
            since = f"; {told(causes)}" if causes else ""
            raise BadRun(f"exit code {code}: {complaint.text}{since}", causes or [complaint])
        return said

    def _complaint(self, problems: str) -> Cause:
        if problems:
            return Cause(FAILED, "", problems)
        complaints = (self.home / COMPLAINED).read_text(errors="replace")
        lines = [line.strip() for line in complaints.split("\n") if line.strip()]
        last_words = lines[-1][-LAST_WORDS:] if lines else "it printed nothing"
        return error_in(complaints) or Cause(FAILED, "", last_words)

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
