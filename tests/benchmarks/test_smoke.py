"""Every benchmark runs with tiny counts and says something of each budget; what it says is not judged."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.__main__ import ALL
from benchmarks.harness import Result
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE

TINY = ("--rounds", "1", "--share", "0.01")
FOR_INFORMATION = {"adaptations", "devices", "memory"}
"""Benchmarks of what has no budget."""


def _benchmark(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own: a benchmark of large messages keeps shared memory until it ends."""
    return subprocess.run(
        [sys.executable, "-m", "benchmarks", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=8 * PATIENCE,
        check=False,
    )


@pytest.mark.parametrize("name", sorted(ALL))
def test_a_benchmark_prints_and_writes_a_figure_for_each_of_its_budgets(name: str, tmp_path: Path) -> None:
    figures = tmp_path / "figures.json"
    ended = _benchmark(name, *TINY, "--json", str(figures))
    assert ended.returncode == 0, ended.stdout + ended.stderr
    written = json.loads(figures.read_text())
    assert {"cores", "load"} <= set(written["machine"]["before"])
    results = []
    for line in written["results"]:
        within = line.pop("within")
        result = Result(**line)
        assert within == result.within
        assert result.name in ended.stdout
        assert math.isfinite(result.figure), result
        assert math.isfinite(result.judged), result
        results.append(result)
    assert results
    assert name in FOR_INFORMATION or any(result.limit is not None for result in results)


def test_an_unknown_benchmark_is_refused_by_name() -> None:
    ended = _benchmark("tree_tock")
    assert ended.returncode == 2
    assert "tree_tick" in ended.stderr
