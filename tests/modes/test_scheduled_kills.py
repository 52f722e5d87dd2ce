"""Manager, planner and laser are killed on a schedule as modes are entered: equal runs, and never half a mode."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import pytest

from regraft.adaptation_manager.journal.journal import Journal
from regraft.adaptation_manager.journal.revisions import architecture_at
from tests.modes.stacks import write
from tests.modes.wholes import whole_modes
from tests.support.commands import in_home, run

pytestmark = pytest.mark.slow

KILLS = (1.2, 2.8, 4.1)
"""As a rule settles, as the normal mode is entered, and as the degraded one is entered again."""


def _run(folder: Path, victim: str) -> dict[str, Any]:
    folder.mkdir()
    home = folder / "home"
    faults = [word for at in KILLS for word in ("--fault", f"{at} {victim} kill")]
    stack = str(write(folder))
    done = run("up", stack, "--headless", "--json", "--for", "8", *faults, environment=in_home(home))
    assert done.stdout, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def _journal(file: Path) -> Journal:
    """Return the journal of the one run that a file has."""
    journal = Journal(str(file))
    ((journal.run,),) = journal.database.execute("SELECT run FROM runs").fetchall()
    return journal


@pytest.mark.parametrize("victim", ["adaptation_manager", "mode_planner", "laser"])
def test_equal_runs_are_equal_and_no_revision_is_half_a_mode(tmp_path: Path, victim: str) -> None:
    runs = [_run(tmp_path / str(number), victim) for number in range(2)]
    assert all(found["reproducible"] for found in runs), runs
    assert len({found["digest"] for found in runs}) == 1, runs
    assert runs[0]["restarts"] == len(KILLS)
    journal = _journal(tmp_path / "0" / "home" / "tests" / "journal.sqlite")
    lines = journal.page(None, 100)
    assert {line.outcome.value for line in lines} <= {"applied", "rolled_back", "rejected"}
    entered = []
    for revision in sorted({line.revision_after for line in lines}):
        architecture = architecture_at(journal, revision)
        assert architecture is not None
        (whole,) = whole_modes(architecture)
        assert architecture.asked_modes in ({}, {"": whole})
        entered.append(whole)
    assert entered[:3] == ["normal", "degraded", "normal"]
    assert all(one != other for one, other in itertools.pairwise(entered))
