"""The FROG stack at full speed: how many simulated seconds pass in a second, starting apart."""

from __future__ import annotations

import json
import statistics
import subprocess
import tempfile
from collections.abc import Mapping
from typing import Any

from benchmarks.harness import Effort, Result
from benchmarks.sides.system import ROOT
from regraft.process.own_python import own_environment, own_python

STACK = ROOT / "regraft" / "stacks" / "frog"
SIMULATED = 60.0
"""Simulated seconds of a run."""
LEAST = 3.0
RUNS = 2
END_TIMEOUT = 180.0
RAY = ("--set", "camera.renderer=ray", "--set", "corner_camera.renderer=ray")
"""The ray camera's own defaults are 160 x 120 at 2 Hz, those of GL are 320 x 240 at 5 Hz."""


def frog(effort: Effort) -> list[Result]:
    """Run it on GL, where there is one, and on the ray camera, in turns."""
    seconds = max(LEAST, SIMULATED * effort.share)
    gl: list[dict[str, Any]] = []
    ray: list[dict[str, Any]] = []
    for _ in range(min(RUNS, effort.rounds)):
        gl.append(run_frog(str(STACK), seconds))
        ray.append(run_frog(str(STACK), seconds, *RAY))
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


def run_frog(stack: str, seconds: float, *options: str, variables: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return what ``regraft up --json`` says in closing; raises RuntimeError if it says nothing."""
    command = own_python("-m", "regraft.cli", "up", stack)
    command += ["--headless", "--json", "--speed", "max", "--for", str(seconds), "--set", "gateway.port=0", *options]
    with tempfile.TemporaryDirectory(prefix="regraft-bench-") as home:
        environment = {**own_environment(), "REGRAFT_HOME": home, **(variables or {})}
        ended = subprocess.run(
            command,
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            timeout=END_TIMEOUT,
            check=False,
        )
    if not ended.stdout.strip():
        raise RuntimeError(f"FROG did not run: {ended.stderr.strip()[-2000:]}")
    said: dict[str, Any] = json.loads(ended.stdout)
    if said.get("real_time_factor") is None:
        raise RuntimeError(f"FROG ended without a real-time factor: {said}")
    return said
