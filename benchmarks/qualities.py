"""The cost of FROG's published qualities: the processor time of a simulated second with them, against that without.

A machine with other work blurs wall times, so these are told for information. Processor time is that of all processes
of the system. A short run next to each long one takes starting and ending out of it.
"""

from __future__ import annotations

import resource
from dataclasses import dataclass

from benchmarks.frog import LEAST, RAY
from benchmarks.harness import Effort, Result, Sides, compared, in_turns
from benchmarks.sides.full_speed import run_at_full_speed
from benchmarks.sides.switched import QUIET
from benchmarks.sides.system import ROOT

SWITCHED = ROOT / "benchmarks" / "sides" / "switched_frog.yaml"
SIMULATED = 60.0
"""Simulated seconds of a long run."""
LEAST_RATIO = 0.98
"""Of the real-time factor without qualities: they may cost 2 %."""


@dataclass(frozen=True, slots=True)
class _Run:
    """A run: seconds of all its processes' work, and of the wall clock per simulated second."""

    processor: float
    wall: float
    digest: str


def qualities(effort: Effort) -> list[Result]:
    """Run FROG at full speed with and without qualities, in turns."""
    seconds = max(2.0 * LEAST, SIMULATED * effort.share)
    digests: dict[float, set[str]] = {}
    wall: dict[str, list[list[float]]] = {"": [], "1": []}

    def processor(quiet: str) -> list[float]:
        short, long = (_run(length, quiet) for length in (LEAST, seconds))
        for length, run in ((LEAST, short), (seconds, long)):
            digests.setdefault(length, set()).add(run.digest)
        wall[quiet].append([long.wall])
        return [(long.processor - short.processor) / (seconds - LEAST)]

    sides = in_turns(effort.rounds, lambda: processor(""), lambda: processor("1"))
    if any(len(of_length) != 1 for of_length in digests.values()):
        raise RuntimeError(f"publishing qualities changes a run: its digests are {digests}")
    note = f"median of {effort.rounds} rounds of {seconds:g} s simulated, less those of {LEAST:g} s; equal digests"
    name, against = "publishing FROG's qualities", "without publishing them"
    blurred = "for information: other work on the machine blurs it"
    clock = Sides(list(wall[""]), list(wall["1"]))
    return [
        compared(f"{name}, processor time", sides, "s per simulated s", against, 1.0 / LEAST_RATIO, note=note),
        compared(f"{name}, wall time", clock, "s per simulated s", against, None, note=blurred),
    ]


def _run(seconds: float, quiet: str) -> _Run:
    before = _processor_time()
    ended = run_at_full_speed(SWITCHED, seconds, *RAY, variables={QUIET: quiet})
    return _Run(_processor_time() - before, 1.0 / float(ended["real_time_factor"]), str(ended["digest"]))


def _processor_time() -> float:
    """Return the seconds of processor time that all ended processes below this one have used."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
