"""In simulated time, with a schedule of failures, equal runs decide alike."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.metacontrol.patrol.stacks import write
from tests.support.commands import in_home, run

pytestmark = pytest.mark.slow

ENTERED = ["normal", "degraded", "degraded_energy_save", "energy_saving", "normal"]


def _run(folder: Path, seconds: float = 15.0, changed: dict[str, str] | None = None) -> dict[str, Any]:
    folder.mkdir()
    stack = write(folder)
    for old, new in (changed or {}).items():
        text = stack.read_text()
        assert old in text
        stack.write_text(text.replace(old, new))
    words = ("up", str(stack), "--headless", "--json", "--for", f"{seconds:g}")
    done = run(*words, environment=in_home(folder / "home"))
    assert done.stdout, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_equal_runs_make_the_published_decisions_at_equal_ticks(tmp_path: Path) -> None:
    runs = [_run(tmp_path / str(each)) for each in range(2)]
    assert all(found["reproducible"] for found in runs), runs
    assert len({found["digest"] for found in runs}) == 1, runs
    assert [mode for _, mode in _entered(runs[0])] == ENTERED


def test_what_could_not_be_entered_for_a_dead_component_is_entered_as_soon_as_that_is_back(tmp_path: Path) -> None:
    long_rest = {"first_rest: 1.0, longest_rest: 2.0": "first_rest: 60.0"}
    dead = {
        "modes: system_modes.yaml": "modes: system_modes.yaml\nfaults: [{at: 2.9, component: bt_navigator, kind: kill}]"
    }
    entered = _entered(_run(tmp_path / "run", 6.0, long_rest | dead))
    failed = {mode for tick, mode in entered if tick == 61}
    assert failed == {"degraded", "degraded_energy_save", "__DEFAULT__"}
    assert [mode for tick, mode in entered if 61 < tick <= 80] == ["degraded"]


def _entered(found: dict[str, Any]) -> list[tuple[int, str]]:
    """Return the modes that were entered, with their ticks."""
    words = (word.partition(" ") for word in found["visits"])
    return sorted((int(tick), mode.removeprefix("to_navigate.")) for mode, _, tick in words if tick)
