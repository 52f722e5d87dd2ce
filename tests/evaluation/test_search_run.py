"""A run of the search has a digest, by which it can be compared with others."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.evaluation.runs.search_run import run_search
from regraft.stack.installed import stack_file

pytestmark = pytest.mark.slow


def test_its_closing_line_has_the_digest_and_how_many_ticks_it_covers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path))  # which the run sets, and nobody after it wants
    run = run_search(stack_file(Path("frog/search.yaml")), 1, tmp_path / "run", at_least=1.0, at_most=1.0)
    assert len(bytes.fromhex(run.closing["digest"])) == 32
    assert run.closing["ticks"] >= 20
    assert run.closing["reproducible"]
