"""The cost of FROG's published qualities: the processor time of a simulated second with them, against that without.

A machine with other work blurs wall times, so these are told for information. Processor time is that of all processes
of the system, without starting and ending: a component samples it every few simulated seconds. Other work makes it
greater, never less. Equal runs do the same work between two samples, so the least of all rounds stands for such a part.
"""

from __future__ import annotations

import tempfile
from itertools import pairwise
from pathlib import Path

from benchmarks.harness import Effort, Result, Sides, compared, in_turns
from benchmarks.robots.frog import LEAST, RAY
from benchmarks.sides.full_speed import run_at_full_speed
from benchmarks.sides.processor_meter import METER, PART
from benchmarks.sides.switched import QUIET
from benchmarks.sides.system import ROOT

SWITCHED = ROOT / "benchmarks" / "sides" / "switched_frog.yaml"
SIMULATED = 60.0
"""Simulated seconds of a run."""
LEAST_RATIO = 0.98
"""Of the real-time factor without qualities: they may cost 2 %."""


def qualities(effort: Effort) -> list[Result]:
    """Run FROG at full speed with and without qualities, in turns."""
    seconds = max(LEAST + 2.0 * PART, SIMULATED * effort.share)
    digests: set[str] = set()
    wall: dict[str, list[list[float]]] = {"": [], "1": []}

    def processor(quiet: str) -> list[float]:
        with tempfile.TemporaryDirectory(prefix="regraft-bench-") as folder:
            samples = Path(folder) / "samples"
            run = run_at_full_speed(SWITCHED, seconds, *RAY, variables={QUIET: quiet, METER: str(samples)})
            taken = [tuple(map(float, line.split())) for line in samples.read_text().splitlines()]
        digests.add(str(run["digest"]))
        wall[quiet].append([1.0 / float(run["real_time_factor"])])
        return [(used - before) / (now - then) for (then, before), (now, used) in pairwise(taken)]

    sides = in_turns(effort.rounds, lambda: processor(""), lambda: processor("1"))
    if len(digests) != 1:
        raise RuntimeError(f"publishing qualities changes a run: its digests are {', '.join(sorted(digests))}")
    pairs = _by_part(sides)
    note = f"median of {len(pairs.ours)} parts of {PART:g} s, each the least of {effort.rounds} rounds; equal digests"
    blurred = "for information: other work on the machine blurs it"
    name, against = "publishing FROG's qualities", "without publishing them"
    clock = Sides(list(wall[""]), list(wall["1"]))
    return [
        compared(f"{name}, processor time", pairs, "s per simulated s", against, 1.0 / LEAST_RATIO, note=note),
        compared(f"{name}, wall time", clock, "s per simulated s", against, None, note=blurred),
    ]


def _by_part(sides: Sides) -> Sides:
    """Return each part of the runs beside the other side's, both as in the round that disturbed them least."""
    ours, theirs = (zip(*runs, strict=True) for runs in (sides.ours, sides.theirs))
    pairs = [(min(mine), min(other)) for mine, other in zip(ours, theirs, strict=True)]
    return Sides([[mine] for mine, _ in pairs], [[other] for _, other in pairs])
