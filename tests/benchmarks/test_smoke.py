"""Every benchmark runs with tiny counts and says something of each budget; what it says is not judged."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from typer import Typer
from typer.testing import CliRunner

from benchmarks.__main__ import ALL, main
from benchmarks.harness import Effort

TINY = Effort(rounds=1, share=0.01)
FOR_INFORMATION = {"adaptations"}
"""Benchmarks of what has no budget."""


@pytest.mark.parametrize("name", sorted(ALL))
def test_a_benchmark_gives_a_figure_for_each_of_its_budgets(name: str) -> None:
    results = ALL[name](TINY)
    assert results
    assert name in FOR_INFORMATION or any(result.limit is not None for result in results)
    for result in results:
        assert math.isfinite(result.figure), result
        assert math.isfinite(result.judged), result


def test_the_command_prints_a_table_and_writes_the_figures(tmp_path: Path) -> None:
    app = Typer()
    app.command()(main)
    figures = tmp_path / "figures.json"
    ended = CliRunner().invoke(app, ["tree_tick", "--rounds", "1", "--share", "0.01", "--json", str(figures)])
    assert ended.exit_code == 0, ended.output
    assert "tree tick, reactive" in ended.output
    written = json.loads(figures.read_text())
    assert {"cores", "load"} <= set(written["machine"]["before"])
    assert all("within" in line for line in written["results"])


def test_an_unknown_benchmark_is_refused_by_name() -> None:
    app = Typer()
    app.command()(main)
    ended = CliRunner().invoke(app, ["tree_tock"])
    assert ended.exit_code == 2
    assert "tree_tick" in ended.output
