"""The commands of the tutorial do what the page says, typed in a folder that knows nothing of the example's module."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from regraft.sim_service.cameras.renderers import FORCE
from tests.support.commands import Command, in_home, run
from tests.support.machine.ports import free_port
from tests.support.paths import ROOT
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

PAGE = (ROOT / "docs" / "components.md").read_text()


def block_with(language: str, text: str) -> str:
    """Return the fenced block of the page that has a text."""
    blocks = re.findall(rf"^```{language}[^\n]*\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    (found,) = (block for block in blocks if text in block)
    return str(found)


def commands() -> list[tuple[list[str], str]]:
    """Return the words of the tutorial's commands with the first line that each prints, the one that joins leading."""
    lines = re.findall(r"^\$ regraft (.*)\n(.*)$", block_with("console", "--join frog"), re.MULTILINE)
    return [(shlex.split(line, comments=True), shown) for line, shown in lines]


def without_numbers(line: str) -> str:
    """Return a line with a mark for each number: these differ from run to run."""
    return re.sub(r"[\d.]+", "#", line)


class Place:
    """Folders of a user: one with the example's module, one with nothing in it; and commands in them."""

    def __init__(self, folder: Path) -> None:
        self.home, self.author, self.foreign = (folder / name for name in ("home", "author", "foreign"))
        self.author.mkdir()
        self.foreign.mkdir()
        (self.author / "watchman.py").write_text(block_with("python", "class Watchman(Component)"))
        self._environment = {**in_home(self.home), FORCE: "ray"}
        self._started: list[Command] = []

    def start(self, folder: Path, *words: str) -> None:
        """Start a command that stays."""
        log = self.home.parent / f"{len(self._started)}.log"
        command = Command(*words, log=log, cwd=folder, environment=self._environment, imported="frog")
        self._started.append(command)

    def regraft(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a command in the foreign folder."""
        return run(*words, cwd=self.foreign, environment=self._environment, within=4 * PATIENCE)

    def states(self) -> dict[str, str]:
        """Return the states of the system's components by name."""
        systems = json.loads(self.regraft("ps", "--json").stdout)["systems"]
        return {component["name"]: component["state"] for system in systems for component in system["components"]}

    def end(self) -> None:
        """End what was started, those that joined first."""
        for command in reversed(self._started):
            command.end()


def are_active(states: Callable[[], dict[str, str]], *names: str) -> Callable[[], bool]:
    """Return a condition: all components are active, and those named are among them."""

    def check() -> bool:
        found = states()
        return set(names) <= found.keys() and set(found.values()) == {"active"}

    return check


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Place]:
    """Run FROG, with the example's component beside it."""
    made = Place(tmp_path_factory.mktemp("tutorial"))
    try:
        made.start(
            made.foreign, "up", str(ROOT / "regraft/stacks/frog"), "--headless", "--set", f"gateway.port={free_port()}"
        )
        wait_until(are_active(made.states, "navigator"), "FROG to be up", 4 * PATIENCE)
        made.start(made.author, *commands()[0][0])
        wait_until(are_active(made.states, "watchman"), "the watchman to be active", 4 * PATIENCE)
        yield made
    finally:
        made.end()


@pytest.mark.parametrize(("words", "shown"), commands()[1:], ids=lambda part: " ".join(part)[:40])
def test_a_command_of_the_tutorial_does_what_the_page_shows(place: Place, words: list[str], shown: str) -> None:
    done = place.regraft(*words)
    is_mistake = shown.startswith("regraft: ")
    assert done.returncode == (2 if is_mistake else 0), done.stderr
    printed = done.stderr if is_mistake else done.stdout
    assert without_numbers(printed.splitlines()[0]) == without_numbers(shown)


def plain(done: subprocess.CompletedProcess[str]) -> Any:
    """Return the last JSON document that a command printed."""
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1] if done.stdout.startswith('{"') else done.stdout)


def test_what_comes_back_is_shown_as_plain_data(place: Place) -> None:
    assert plain(place.regraft("service", "call", "forget", "--json")).keys() == {"count"}
    watched = place.regraft("action", "send", "watch", "{duration: 1.5}", "--feedback", "--json")
    assert [json.loads(line).keys() for line in watched.stdout.splitlines()] == [{"count"}] * 3


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("{}", "duration: is missing: must be a number"),
        ("{duration: soon}", "duration: is str, must be a number"),
        ("{duration: 1, durations: 2}", "has no field 'durations'; did you mean 'duration'?"),
        ("[1]", "is list, must be a map with the fields of Watch"),
    ],
)
def test_a_body_that_does_not_fit_is_refused_before_anything_is_sent(place: Place, body: str, told: str) -> None:
    done = place.regraft("action", "send", "watch", body)
    assert done.returncode == 2
    assert done.stdout == ""
    assert f"the body is no patrol/Watch: {told}" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_message_of_such_a_type_can_be_put_on_its_topic(place: Place) -> None:
    done = place.regraft("topic", "pub", "nearness", "{stamp: 1.0, distance: near}")
    assert done.returncode == 2
    assert "distance: is str, must be a number" in done.stderr
    sent = place.regraft("topic", "pub", "nearness", "{stamp: 1.0, distance: 2}", "--json")
    assert plain(sent) == {
        "topic": "nearness",
        "type": "patrol/Nearness",
        "message": {"stamp": 1.0, "distance": 2.0},
    }


def test_its_schema_can_be_read_anywhere(place: Place) -> None:
    schema = plain(place.regraft("types", "patrol/Watch"))
    assert schema["required"] == ["duration"]
    unknown = place.regraft("types", "patrol/Wach")
    assert unknown.returncode == 2
    assert "patrol/Wach" in unknown.stderr
