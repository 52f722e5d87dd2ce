"""Many components and many robots in one world at full speed, starting apart."""

from __future__ import annotations

import statistics
import tempfile
from dataclasses import replace
from pathlib import Path

from benchmarks.harness import Effort, Result, compared, in_turns
from benchmarks.sides.full_speed import FROG, run_at_full_speed
from benchmarks.stacks import eight_frogs, two_epucks

SIMULATED = 60.0
"""Simulated seconds of a run."""
LEAST = 3.0
ROUNDS = 3


def many(effort: Effort) -> list[Result]:
    """Run two e-pucks in turns with FROG, then eight FROGs."""
    seconds = max(LEAST, SIMULATED * effort.share)
    rounds = min(ROUNDS, effort.rounds)
    with tempfile.TemporaryDirectory(prefix="regraft-bench-") as folder:
        return [_two_epucks(Path(folder), seconds, rounds), _eight_frogs(Path(folder), seconds, rounds)]


def _two_epucks(folder: Path, seconds: float, rounds: int) -> Result:
    stack = two_epucks.written(_made(folder / "two_epucks"))
    sides = in_turns(rounds, lambda: [_factor(stack, seconds)], lambda: [_factor(FROG, seconds)])
    note = f"{rounds} runs of {seconds:g} s simulated each"
    result = compared("two e-pucks, 21 components", sides, "x real time", "FROG", 0.6, note=note)
    return replace(result, at_least=True)


def _eight_frogs(folder: Path, seconds: float, rounds: int) -> Result:
    stack = eight_frogs.written(_made(folder / "eight_frogs"))
    factors = [_factor(stack, seconds) for _ in range(rounds)]
    return Result(
        "eight FROGs in one world, 84 components",
        statistics.median(factors),
        "x real time",
        spread=(min(factors), max(factors)),
        limit=1.0,
        at_least=True,
        note=f"{rounds} runs of {seconds:g} s simulated, ray cameras",
    )


def _factor(stack: Path, seconds: float) -> float:
    return float(run_at_full_speed(stack, seconds)["real_time_factor"])


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder
