"""In simulated time, with a schedule of failures, equal runs decide alike."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.metacontrol.patrol.stacks import write
from tests.support.commands import in_home, run

ENTERED = ["normal", "degraded", "degraded_energy_save", "energy_saving", "normal"]


def _run(folder: Path) -> dict[str, Any]:
    folder.mkdir()
    done = run("up", str(write(folder)), "--headless", "--json", "--for", "15", environment=in_home(folder / "home"))
    assert done.stdout, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_equal_runs_make_the_published_decisions_at_equal_ticks(tmp_path: Path) -> None:
    runs = [_run(tmp_path / str(each)) for each in range(2)]
    assert all(found["reproducible"] for found in runs), runs
    assert len({found["digest"] for found in runs}) == 1, runs
    entered = sorted((int(tick), mode) for mode, _, tick in (w.partition(" ") for w in runs[0]["visits"]) if tick)
    assert [mode.removeprefix("to_navigate.") for _, mode in entered] == ENTERED
