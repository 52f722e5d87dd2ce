"""Runs FROG's search once, to its mission's end, and has it judged."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from regraft.bus_schema.messages.evaluation import RunSummary, RunSummaryRequest
from regraft.bus_schema.messages.health import Event
from regraft.cli.system.closing import SUMMARY_TIMEOUT, plain_summary, summary_services
from regraft.client import Client
from regraft.evaluation.judgement import Judgement, JudgementRequest
from regraft.evaluation.runs.stack_run import END_TIMEOUT, LOOK_INTERVAL, RunFailed, running, started
from regraft.patience import Patience, stretched

MISSION_ENDS = ("mission.succeeded", "mission.failed", "mission.halted")
TOLD = ("mission.", "world.contact", "sensor.", "mapper.", "adaptation.", "component.fault", "component.restarted")
STANDS_STILL_TIMEOUT = 60.0
"""s of wall-clock time in which simulated time has to continue; more on a crowded machine."""
WORD_SPREADS = 2.0
"""s of simulated time until the judge has heard of the mission's end, too."""


@dataclass(frozen=True, slots=True)
class SearchRun:
    """The result of one seed: the judgement, the reports, and the closing line of ``regraft up``.

    ``closing`` has the summary of the moment of the judgement: its ``digest`` covers the first ``ticks``. Equal runs
    that are judged at the same tick have the same one.
    """

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
    with running(stack, seed, home, options) as process:
        judgement, events, summary = _watch(process, home, at_least, at_most)
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=END_TIMEOUT)
    closing = json.loads(said) if said.strip() else {}
    return SearchRun(seed, judgement, events, closing | summary)


def _watch(
    process: subprocess.Popen[str], home: Path, at_least: float, at_most: float
) -> tuple[Judgement, tuple[Event, ...], dict[str, Any]]:
    with Client.connect(started(process, home)) as client:
        events: list[Event] = []
        reached, moves = -1.0, Patience(STANDS_STILL_TIMEOUT)
        client.events(lambda event: events.append(event) if event.kind.startswith(TOLD) else None)
        while process.poll() is None:
            time.sleep(LOOK_INTERVAL)
            told = client.clock()
            now = told.time / 1e9 if told else 0.0
            if now > reached:
                reached, moves = now, Patience(STANDS_STILL_TIMEOUT)
            elif moves.is_over():
                raise RunFailed(f"simulated time stood still at {now:.2f} s, see {home / 'up.log'}")
            ended = min((event.stamp for event in events if event.kind in MISSION_ENDS), default=math.inf)
            if now >= min(at_most, max(at_least, ended + WORD_SPREADS)):
                judgement = client.call("judgement", JudgementRequest(), Judgement, stretched(20.0))
                return judgement, tuple(sorted(events, key=lambda event: event.stamp)), _summary(client)
    raise RunFailed(f"it ended by itself with exit code {process.returncode}, see {home / 'up.log'}")


def _summary(client: Client) -> dict[str, Any]:
    """Return the summary of the run so far, empty where no component sums it up."""
    found = {
        name: client.call(service, RunSummaryRequest(), RunSummary, stretched(SUMMARY_TIMEOUT))
        for name, service in summary_services(client.architecture()).items()
    }
    return plain_summary(found)
