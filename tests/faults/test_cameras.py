"""A camera or its reader dies while pictures are deferred that nobody has opened: the run stays repeatable."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.frog import run_frog

pytestmark = pytest.mark.slow

KILLS = ("3.1 camera kill", "5.6 detector kill", "8.3 camera kill")


def test_pictures_that_end_with_their_camera_make_no_run_another(tmp_path: Path) -> None:
    faults = [word for fault in KILLS for word in ("--fault", fault)]
    runs = [run_frog(tmp_path / str(n), 12.0, "--speed", "max", *faults) for n in (1, 2)]
    for run in runs:
        assert (run.code, run.summary["reproducible"], run.summary["restarts"]) == (0, True, 3), run.errors
    assert runs[0].summary["digest"] == runs[1].summary["digest"]
    assert runs[0].summary["pictures"]["camera"] > 0
