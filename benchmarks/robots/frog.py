"""The FROG stack at full speed: how many simulated seconds pass in a second, starting apart."""

from __future__ import annotations

import statistics
from typing import Any

from benchmarks.harness import Effort, Result
from benchmarks.sides.full_speed import FROG, run_at_full_speed

SIMULATED = 60.0
"""Simulated seconds of a run."""
LEAST = 3.0
RUNS = 2
RAY = ("--set", "camera.renderer=ray", "--set", "corner_camera.renderer=ray")
"""The ray camera's own defaults are 160 x 120 at 2 Hz, those of GL are 320 x 240 at 5 Hz."""


def frog(effort: Effort) -> list[Result]:
    """Run it on GL, where there is one, and on the ray camera, in turns."""
    seconds = max(LEAST, SIMULATED * effort.share)
    gl: list[dict[str, Any]] = []
    ray: list[dict[str, Any]] = []
    for _ in range(min(RUNS, effort.rounds)):
        gl.append(run_at_full_speed(FROG, seconds))
        ray.append(run_at_full_speed(FROG, seconds, *RAY))
    return [_result("FROG at full speed, GL", gl, 10.0), _result("FROG at full speed, ray camera", ray, 5.0)]


def _result(name: str, runs: list[dict[str, Any]], limit: float) -> Result:
    factors = [float(run["real_time_factor"]) for run in runs]
    note = f"{len(runs)} runs of {runs[0]['simulated_s']:g} s simulated, renderer {runs[0]['renderer']}"
    return Result(
        name,
        statistics.median(factors),
        "x real time",
        spread=(min(factors), max(factors)),
        limit=limit,
        at_least=True,
        note=note,
    )
