"""A component that hangs keeps no command from the others, whether a debugger or a mistake of its author holds it."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from tests.cli.live import System, regraft
from tests.support.commands import Command, in_home
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

DEBUGGED = """
import time
from pathlib import Path
from regraft import Component, Parameter, every

class Debugged(Component):
    speed = Parameter(1.0, "how fast")

    @every(hz=20)
    def hang(self):
        Path("hangs").touch()
        while not Path("released").exists():
            time.sleep(0.02)
"""


@pytest.fixture(scope="module")
def hung(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Run the tiny stack, joined by a component that hangs in its timer for as long as the tests run."""
    folder = tmp_path_factory.mktemp("debugged")
    (folder / "debugged.py").write_text(DEBUGGED)
    with System(folder / "home") as system:
        words = ("run", "--join", "tiny", "debugged:Debugged")
        joined = Command(*words, log=folder / "joined.log", cwd=folder, environment=in_home(system.home))
        system.joined.append(joined)
        try:
            wait_until((folder / "hangs").exists, "the component to hang")
            yield system
        finally:
            (folder / "released").touch()


@pytest.mark.parametrize(
    "words",
    [
        ("param", "set", "talker", "step=2"),
        ("param", "get", "talker", "step"),
        ("lifecycle", "set", "listener", "activate", "--dry-run"),
        ("connect", "listener", "hint", "number"),
        ("topic", "list"),
    ],
    ids=" ".join,
)
def test_a_hung_component_keeps_no_command_from_the_others(hung: System, words: tuple[str, ...]) -> None:
    done = regraft(hung.home, *words, "--json")
    assert done.returncode == (1 if "--dry-run" in words else 0), done
    json.loads(done.stdout)
    (line,) = [line for line in done.stderr.splitlines() if "debugged" in line]
    assert line.startswith("regraft: component 'debugged' did not answer")
    assert line.endswith("it is left out")


def test_an_adaptation_is_undone_while_a_component_hangs(hung: System) -> None:
    before = hung.ask("param", "get", "listener", "offset")["value"]
    report = hung.ask("param", "set", "listener", f"offset={before + 1}")
    assert hung.ask("undo", report["id"])["outcome"] == "applied"
    assert hung.ask("param", "get", "listener", "offset")["value"] == before


@pytest.mark.parametrize(
    "words",
    [("param", "get", "debugged", "speed"), ("lifecycle", "get", "debugged"), ("param", "set", "debugged", "speed=2")],
    ids=" ".join,
)
def test_what_is_asked_of_the_hung_component_itself_exits_with_3(hung: System, words: tuple[str, ...]) -> None:
    done = regraft(hung.home, *words, "--json")
    assert (done.returncode, done.stdout) == (3, "")
    assert json.loads(done.stderr.splitlines()[-1])["code"] == "not_reachable"


def test_states_are_listed_also_where_one_component_hangs(hung: System) -> None:
    rows = {row["component"]: row for row in hung.ask("lifecycle", "list")["components"]}
    assert (rows["talker"]["state"], rows["talker"]["error"]) == ("active", "")
    assert (rows["debugged"]["state"], rows["debugged"]["transitions"]) == (None, [])
    assert "did not answer" in rows["debugged"]["error"]
