"""The README's commands work from the folder above a clone whose name is a package's."""

from __future__ import annotations

import json
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from regraft import run_directory
from regraft.sim_service.cameras.renderers import FORCE
from tests.docs.test_docs import commands_in
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

REGRAFT = Path(sys.executable).parent / "regraft"
README = ROOT / "README.md"
ASKED = "frog/rounds.yaml"
"""The stack that the README's questions are put to: FROG, and more."""
LARGE = "demo_two_robots"
"""The stack that tests/two_robots run, and make evidence from above as well."""
ANY_PORT = ("--set", "gateway.port=0")
SHORT = ("--headless", "--speed", "max", "--for", "1", *ANY_PORT, "--json")
UNTIL_INTERRUPTED = ("--headless", "--speed", "real", "--for", "3600", *ANY_PORT, "--json")
ONE_RUN = ("--runs", "1", "--configurations", "baseline.rooms", "--for", "2")
WHILE_IT_RUNS = ("ps", "param", "lifecycle")


@pytest.fixture
def above(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Go to a folder in which the project stands as ``regraft``: to Python, a package without ``__init__``."""
    (tmp_path / "regraft").symlink_to(ROOT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    monkeypatch.setenv(FORCE, "ray")  # OpenGL takes longer to start than these runs last
    return tmp_path


def _commands(*names: str) -> list[list[str]]:
    """Return the README's commands of these names as they are typed one folder further up."""
    found = [shlex.split(text, comments=True)[1:] for text in dict.fromkeys(commands_in(README))]
    return [words for words in found if words[0] in names]


def _done(words: list[str]) -> str:
    ended = subprocess.run(
        [REGRAFT, *words],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=4 * PATIENCE,
        check=False,
    )
    assert ended.returncode == 0, (words, ended.stdout, ended.stderr)
    return ended.stdout


def _others(*, large: bool) -> list[list[str]]:
    """Return the commands that run the README's other stacks."""
    return [words for words in _commands("up") if ASKED not in words and (LARGE in words) is large]


@pytest.mark.usefixtures("above")
@pytest.mark.parametrize(
    "words",
    [*_others(large=False), *(pytest.param(words, marks=pytest.mark.evidence) for words in _others(large=True))],
    ids=lambda words: words[1],
)
def test_a_stack_of_the_readme_runs(words: list[str]) -> None:
    assert json.loads(_done([*words, *SHORT]))["dropped"] == []


def test_an_evaluation_runs(above: Path) -> None:
    (words,) = _commands("evaluate")
    _done([*words, *ONE_RUN, "--out", str(above / "out")])


def test_a_stack_of_the_readme_runs_and_what_the_readme_asks_of_a_running_robot_is_answered(above: Path) -> None:
    (up,) = (words for words in _commands("up") if ASKED in words)
    questions = _commands(*WHILE_IT_RUNS)
    assert len(questions) >= 4
    with (above / "closing.json").open("w") as closing, (above / "up.log").open("w") as log:
        running = subprocess.Popen(
            [REGRAFT, *up, *UNTIL_INTERRUPTED], stdin=subprocess.DEVNULL, stdout=closing, stderr=log
        )
    try:
        wait_until(lambda: run_directory.running() or running.poll() is not None, "the robot to run", 60.0)
        for words in questions:
            _done(words)
        running.send_signal(signal.SIGINT)
        assert running.wait(4 * PATIENCE) == 0, (above / "up.log").read_text()
    finally:
        running.kill()
        running.wait()
    assert json.loads((above / "closing.json").read_text())["dropped"] == []
