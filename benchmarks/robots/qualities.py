"""The cost of FROG's published qualities: the processor time of a simulated second with them, against that without.

Their share is smaller than what two equal runs differ by. So they are measured ten times a second instead of once. In
other runs the same components are called as often and do nothing. A tenth of the difference is their cost.

Processor time is that of all processes of the system, without starting and ending: a component samples it every few
simulated seconds. Other work makes it greater, never less. Equal runs do the same work between two samples, so the
least of all rounds stands for such a part.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from benchmarks.harness import Effort, Result, Sides, all_in_turns, compared
from benchmarks.robots.frog import LEAST, RAY
from benchmarks.sides.full_speed import run_at_full_speed
from benchmarks.sides.processor_meter import METER, PART
from benchmarks.sides.switched import BEATS, MEASURES, OFTEN
from benchmarks.sides.system import ROOT

SWITCHED = ROOT / "benchmarks" / "sides" / "switched_frog.yaml"
SIMULATED = 60.0
"""Simulated seconds of a run."""
LIMIT = 1.0 / 0.98
"""Of the processor time without qualities: they may make a run 2 % slower."""
EVERY = 1.0
"""Seconds between two measurements of a component as it is."""


def qualities(effort: Effort) -> list[Result]:
    """Run FROG at full speed with qualities that are measured often, with calls as often, and with neither."""
    seconds = max(LEAST + 2.0 * PART, SIMULATED * effort.share)
    digests: set[str] = set()

    def processor(*switched_on: str) -> list[float]:
        with tempfile.TemporaryDirectory(prefix="regraft-bench-") as folder:
            samples = Path(folder) / "samples"
            variables = {**dict.fromkeys(switched_on, "1"), METER: str(samples)}
            run = run_at_full_speed(SWITCHED, seconds, *RAY, variables=variables)
            taken = [tuple(map(float, line.split())) for line in samples.read_text().splitlines()]
        digests.add(str(run["digest"]))
        return [(used - before) / (now - then) for (then, before), (now, used) in pairwise(taken)]

    runs = all_in_turns(effort.rounds, lambda: processor(MEASURES, BEATS), lambda: processor(BEATS), processor)
    if len(digests) != 1:
        raise RuntimeError(f"publishing qualities changes a run: its digests are {', '.join(sorted(digests))}")
    pairs = _by_part(*map(_least, runs))
    parts = f"{len(pairs.ours)} parts of {PART:g} s, each the least of {effort.rounds} rounds"
    note = f"median of {parts}; a tenth of what ten measurements a second add"
    name, against = "publishing FROG's qualities, processor time", "without publishing them"
    return [compared(name, pairs, "s per simulated s", against, LIMIT, note=note)]


def _least(runs: list[Sequence[float]]) -> list[float]:
    """Return each part of equal runs as in the one that disturbed it least."""
    return [min(parts) for parts in zip(*runs, strict=True)]


def _by_part(measured: list[float], called: list[float], plain: list[float]) -> Sides:
    """Return each part of a run with its qualities, and without."""
    costs = [(often - idle) * OFTEN / EVERY for often, idle in zip(measured, called, strict=True)]
    return Sides([[base + cost] for base, cost in zip(plain, costs, strict=True)], [[base] for base in plain])
