"""Runs of FROG in which a changer carries out a script of adaptations."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.support.frog import Run, run_frog
from tests.support.paths import FROG


def scripted(folder: Path, stack: str, seconds: float, script: list[Any]) -> tuple[Run, list[str]]:
    """Run a stack of FROG's with a changer in it; returns how it ended, and what became of the adaptations."""
    path = with_changer(folder, stack, script)
    return run_frog(folder / "home", seconds, "--speed", "max", stack=path), told(folder / "home")


def told(home: Path) -> list[str]:
    """Return what the changer of a run has said."""
    log = next(home.glob("*/logs/changer.log")).read_text()
    return [line for line in log.splitlines() if line.startswith(("adaptation", "seen"))]


def with_changer(folder: Path, stack: str, script: list[Any]) -> Path:
    """Write a stack of FROG's with a changer in it into a new folder; returns its file."""
    folder.mkdir()
    for part in FROG.iterdir():
        if part.suffix != ".yaml":
            (folder / part.name).symlink_to(part)
    (folder / "script.json").write_text(json.dumps(script))
    changer = "components:\n  changer: {class: 'tests.frog.changer:Changer', parameters: {script: script.json}}\n"
    (folder / "stack.yaml").write_text(f"include: [{FROG / stack}]\n{changer}")
    return folder / "stack.yaml"


def applied(run: Run, said: list[str], script: list[Any]) -> Run:
    """Return a run all of whose adaptations were applied, and which simulated time has not left."""
    adaptations = [line for line in said if line.startswith("adaptation")]
    assert [line.split()[1] for line in adaptations] == ["applied"] * len(script), said
    assert len(said) == len(script) + sum(bool(service) for *_, service in script)
    assert run.summary["reproducible"] is True, run.errors
    assert run.summary["dropped"] == []
    return run


def twice(tmp_path: Path, stack: str, seconds: float, script: list[Any]) -> Run:
    """Run one script twice, to the same end; returns the first run."""
    (first, said), (second, said_again) = (scripted(tmp_path / name, stack, seconds, script) for name in ("one", "two"))
    assert said == said_again
    assert first.summary["digest"] == second.summary["digest"], second.errors
    return applied(first, said, script)
