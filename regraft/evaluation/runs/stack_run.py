"""A stack that is run at full speed to be looked at: started as a user would, ended in any case."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from regraft import run_directory
from regraft.evaluation.runs.own_up import up_command, up_environment
from regraft.patience import Patience

STARTED_TIMEOUT = 60.0
END_TIMEOUT = 30.0
LOOK_INTERVAL = 0.1


class RunFailed(Exception):
    """A run could not be started or judged."""


@contextmanager
def running(stack: Path, seed: int, home: Path, options: tuple[str, ...] = ()) -> Iterator[subprocess.Popen[str]]:
    """Run ``regraft up`` with further ``options``; ``home`` takes the run's files, and its complaints in ``up.log``.

    Its closing line is its output. At the end it is interrupted if it still runs, and killed if that takes too long.
    """
    command = up_command(stack, seed, "--set", "gateway.port=0", *options)
    os.environ["REGRAFT_HOME"] = str(home)
    home.mkdir(parents=True, exist_ok=True)
    with (home / "up.log").open("w") as errors:
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            stdin=subprocess.DEVNULL,
            env=up_environment(home),
        )
    try:
        yield process
    finally:
        if process.poll() is None:
            _end(process)


def _end(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGINT)
    try:
        process.communicate(timeout=END_TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()


def started(process: subprocess.Popen[str], home: Path) -> run_directory.RunInfo:
    """Wait until a process of ``regraft up`` has brought its system up; raises RunFailed."""
    comes_up = Patience(STARTED_TIMEOUT)
    while not comes_up.is_over() and process.poll() is None:
        there = run_directory.running()
        if there:
            return there[0]
        time.sleep(LOOK_INTERVAL)
    raise RunFailed(f"it did not come up within {STARTED_TIMEOUT:g} s, see {home / 'up.log'}")
