"""Runs FROG's search once, to its mission's end, and has it judged."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bus_schema.messages.health import Event
from evaluation.judgement import Judgement, JudgementRequest
from regraft import rundir
from regraft.client import Client

MISSION_ENDS = ("mission.succeeded", "mission.failed", "mission.halted")
TOLD = ("mission.", "world.contact", "sensor.", "mapper.", "adaptation.", "component.fault", "component.restarted")
STARTED_WITHIN = 60.0
ENDS_WITHIN = 30.0
STANDS_STILL_WITHIN = 60.0
"""s of wall-clock time in which simulated time has to go on."""
LOOK_EVERY = 0.1
WORD_SPREADS = 2.0
"""s of simulated time until the judge has heard of the mission's end, too."""


class RunFailed(Exception):
    """A run could not be started or judged."""


@dataclass(frozen=True, slots=True)
class SearchRun:
    """What became of one seed: the judgement, what was told, and the closing line of ``regraft up``."""

    seed: int
    judgement: Judgement
    events: tuple[Event, ...]
    closing: dict[str, Any]


def run_search(
    stack: Path, seed: int, home: Path, *, at_least: float, at_most: float, options: tuple[str, ...] = ()
) -> SearchRun:
    """Run a stack at full speed until its mission has ended, from ``at_least`` to ``at_most`` simulated seconds.

    ``home`` takes the run's files; ``options`` go to ``regraft up``.

    Raises:
        RunFailed: it did not come up, or ended before it could be judged.
    """
    command = [sys.executable, "-m", "regraft.cli", "up", str(stack), "--headless", "--json", "--speed", "max"]
    command += ["--seed", str(seed), "--set", "gateway.port=0", *options]
    os.environ["REGRAFT_HOME"] = str(home)
    home.mkdir(parents=True, exist_ok=True)
    with (home / "up.log").open("w") as errors:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, stdin=subprocess.DEVNULL)
    try:
        judgement, events = _watch(process, home, at_least, at_most)
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=ENDS_WITHIN)
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    return SearchRun(seed, judgement, events, json.loads(said) if said.strip() else {})


def _watch(
    process: subprocess.Popen[str], home: Path, at_least: float, at_most: float
) -> tuple[Judgement, tuple[Event, ...]]:
    with Client.connect(started(process, home)) as client:
        events: list[Event] = []
        reached, moved_at = -1.0, time.monotonic()
        client.events(lambda event: events.append(event) if event.kind.startswith(TOLD) else None)
        while process.poll() is None:
            time.sleep(LOOK_EVERY)
            told = client.clock()
            now = told.time / 1e9 if told else 0.0
            if now > reached:
                reached, moved_at = now, time.monotonic()
            elif time.monotonic() - moved_at > STANDS_STILL_WITHIN:
                raise RunFailed(f"simulated time stood still at {now:.2f} s, see {home / 'up.log'}")
            ended = min((event.stamp for event in events if event.kind in MISSION_ENDS), default=math.inf)
            if now >= min(at_most, max(at_least, ended + WORD_SPREADS)):
                judgement = client.call("judgement", JudgementRequest(), Judgement, 20.0)
                return judgement, tuple(sorted(events, key=lambda event: event.stamp))
    raise RunFailed(f"it ended by itself with exit code {process.returncode}, see {home / 'up.log'}")


def started(process: subprocess.Popen[str], home: Path) -> rundir.RunInfo:
    """Wait until a process of ``regraft up`` has brought its system up; raises RunFailed."""
    deadline = time.monotonic() + STARTED_WITHIN
    while time.monotonic() < deadline and process.poll() is None:
        running = rundir.running()
        if running:
            return running[0]
        time.sleep(LOOK_EVERY)
    raise RunFailed(f"it did not come up within {STARTED_WITHIN:g} s, see {home / 'up.log'}")
