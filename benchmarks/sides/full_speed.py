"""Runs of whole stacks in simulated time, as fast as they go."""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.sides.system import ROOT
from regraft.process.own_python import own_environment, own_python

FROG = ROOT / "regraft" / "stacks" / "frog"
END_TIMEOUT = 300.0


def run_at_full_speed(
    stack: Path, seconds: float, *options: str, variables: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Return what ``regraft up --json`` says in closing; raises RuntimeError if it says nothing."""
    command = own_python("-m", "regraft.cli", "up", str(stack))
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
        raise RuntimeError(f"{stack} did not run: {ended.stderr.strip()[-2000:]}")
    said: dict[str, Any] = json.loads(ended.stdout)
    if said.get("real_time_factor") is None:
        raise RuntimeError(f"{stack} ended without a real-time factor: {said}")
    return said
