"""Every benchmark runs with tiny counts and says something of each budget; what it says is not judged."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchmarks.__main__ import ALL
from benchmarks.harness import Result
from benchmarks.robots.qualities import SWITCHED
from benchmarks.stacks import eight_frogs, two_epucks
from regraft.stack import load
from tests.support.paths import FROG, ROOT
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow

TINY = ("--rounds", "1", "--share", "0.01")
FOR_INFORMATION = {"adaptations", "devices", "memory"}
"""Benchmarks of what has no budget."""
QUICK = ("adaptations", "choices", "neighbours", "round_trip", "set_parameter", "tree_tick")
"""Benchmarks of each kind: in a process, between two, and of a system. Those of whole robots and hosts take longer."""
LARGE = sorted(set(ALL) - set(QUICK))


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


def _figures(folder: Path, *names: str) -> tuple[str, dict[str, Any]]:
    """Return what benchmarks print, and what they write; some may have failed."""
    ended = _benchmark(*names, *TINY, "--json", str(folder / "figures.json"))
    assert ended.returncode in (0, 1), ended.stdout + ended.stderr
    written = json.loads((folder / "figures.json").read_text())
    assert (ended.returncode == 1) is bool(written["failed"]), ended.stdout + ended.stderr
    return ended.stdout, written


def _check(name: str, printed: str, written: dict[str, Any]) -> None:
    """Check that a benchmark has not failed, and has figures, of its budgets too."""
    assert name not in written["failed"], printed
    assert {"cores", "load"} <= set(written["machine"]["before"])
    results = []
    for line in written["results"]:
        if line["benchmark"] == name:
            fields = {key: value for key, value in line.items() if key not in ("benchmark", "within")}
            result = Result(**fields)
            assert line["within"] == result.within
            assert result.name in printed
            assert math.isfinite(result.figure), result
            assert math.isfinite(result.judged), result
            results.append(result)
    assert results
    assert name in FOR_INFORMATION or any(result.limit is not None for result in results)


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, dict[str, Any]]:
    """Return what the quick benchmarks print and write, in one process."""
    return _figures(tmp_path_factory.mktemp("figures"), *QUICK)


@pytest.mark.parametrize("name", QUICK)
def test_a_benchmark_prints_and_writes_a_figure_for_each_of_its_budgets(
    name: str, quick: tuple[str, dict[str, Any]]
) -> None:
    _check(name, *quick)


@pytest.mark.evidence
@pytest.mark.alone
@pytest.mark.parametrize("name", LARGE)
def test_a_large_benchmark_prints_and_writes_a_figure_for_each_of_its_budgets(name: str, tmp_path: Path) -> None:
    _check(name, *_figures(tmp_path, name))


@pytest.mark.parametrize(
    ("write", "components"), [(two_epucks.written, 21), (eight_frogs.written, 84)], ids=["two_epucks", "eight_frogs"]
)
def test_the_stacks_of_many_can_be_run_and_have_as_many_components_as_their_figures_say(
    write: Callable[[Path], Path], components: int, tmp_path: Path
) -> None:
    assert len(load(write(tmp_path)).architecture.components) == components


def test_the_stack_without_qualities_has_the_components_of_frog_and_a_meter() -> None:
    frog = load(FROG / "stack.yaml").architecture.components.keys()
    assert load(SWITCHED).architecture.components.keys() == frog | {"processor_meter"}


def test_an_unknown_benchmark_is_refused_by_name() -> None:
    ended = _benchmark("tree_tock")
    assert ended.returncode == 2
    assert "tree_tick" in ended.stderr
