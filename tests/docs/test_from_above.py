"""The README's commands work from the folder above a clone whose name is a package's."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.test_docs import commands_in
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE

REGRAFT = Path(sys.executable).parent / "regraft"
README = ROOT / "README.md"
SHORT = ("--headless", "--speed", "max", "--for", "1", "--set", "gateway.port=0", "--json")
ONE_RUN = ("--runs", "1", "--configurations", "baseline", "--for", "5")
WHILE_IT_RUNS = ("ps", "param", "lifecycle")


@pytest.fixture
def above(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to a folder in which the project stands as ``regraft``: to Python, a package without ``__init__``."""
    (tmp_path / "regraft").symlink_to(ROOT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    return tmp_path


def _commands(*names: str) -> list[list[str]]:
    """Return the README's commands of these names as they are typed one folder further up."""
    found = [shlex.split(text, comments=True)[1:] for text in dict.fromkeys(commands_in(README))]
    return [words for words in found if words[0] in names]


def _done(words: list[str], home: Path) -> str:
    ended = subprocess.run(
        [REGRAFT, *words],
        env={**os.environ, "REGRAFT_HOME": str(home)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=4 * PATIENCE,
        check=False,
    )
    assert ended.returncode == 0, (words, ended.stdout, ended.stderr)
    return ended.stdout


def test_every_stack_of_the_readme_runs(above: Path) -> None:
    commands = _commands("up")
    assert len(commands) >= 2
    for words in commands:
        assert json.loads(_done([*words, *SHORT], above / "home"))["dropped"] == []


def test_an_evaluation_runs(above: Path) -> None:
    (words,) = _commands("evaluate")
    _done([*words, *ONE_RUN, "--out", str(above / "out")], above / "home")


@pytest.mark.usefixtures("above", "frog")
def test_what_the_readme_asks_of_a_running_robot_is_answered() -> None:
    commands = _commands(*WHILE_IT_RUNS)
    assert len(commands) >= 4
    for words in commands:
        _done(words, Path(os.environ["REGRAFT_HOME"]))
