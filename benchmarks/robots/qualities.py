"""The cost of FROG's published qualities: its real-time factor with them, against that without, in turns."""

from __future__ import annotations

import resource
from collections.abc import Sequence

from benchmarks.harness import Effort, Result, Sides, compared, in_turns
from benchmarks.robots.frog import LEAST, RAY
from benchmarks.sides.full_speed import run_at_full_speed
from benchmarks.sides.switched import QUIET
from benchmarks.sides.system import ROOT

SWITCHED = ROOT / "benchmarks" / "sides" / "switched_frog.yaml"
SIMULATED = 60.0
"""Simulated seconds of a run."""
LEAST_RATIO = 0.98
"""Of the real-time factor without qualities: they may cost 2 %."""


def qualities(effort: Effort) -> list[Result]:
    """Run FROG at full speed with and without qualities."""
    seconds = max(LEAST, SIMULATED * effort.share)
    digests: set[str] = set()
    used: dict[str, list[Sequence[float]]] = {"": [], "1": []}

    def wall(quiet: str) -> list[float]:
        before = _processor_time()
        run = run_at_full_speed(SWITCHED, seconds, *RAY, variables={QUIET: quiet})
        used[quiet].append([(_processor_time() - before) / seconds])
        digests.add(str(run["digest"]))
        return [1.0 / float(run["real_time_factor"])]

    sides = in_turns(effort.rounds, lambda: wall(""), lambda: wall("1"))
    if len(digests) != 1:
        raise RuntimeError(f"publishing qualities changes a run: its digests are {', '.join(sorted(digests))}")
    note = f"{effort.rounds} runs of {seconds:g} s simulated each, in turns; equal digests"
    name, against = "publishing FROG's qualities", "without publishing them"
    processor = Sides(used[""], used["1"])
    start = "starting and ending included"
    return [
        compared(name, sides, "s per simulated s", against, 1.0 / LEAST_RATIO, note=note),
        compared(f"{name}, processor time", processor, "s per simulated s", against, None, note=start),
    ]


def _processor_time() -> float:
    """Return the seconds of processor time that all ended processes below this one have used."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
