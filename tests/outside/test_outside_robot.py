"""A robot with a device of its own comes in from somebody else's package, with the stack that has two of it."""

from __future__ import annotations

import json
import math
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from regraft import run_directory
from tests.outside.installing import having, installed_package, regraft, started
from tests.support.commands import Command
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

PACKAGE = Path(__file__).parent / "robot_package"
FAILING = "world.failures=[{at: 3, device: north/compass, failure: bias}]"
SHORT = ("--headless", "--json", "--speed", "max", "--for", "5", "--system", "yard")


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder in which the package is installed."""
    return installed_package(PACKAGE, tmp_path_factory)


@pytest.fixture
def user(installed: Path, tmp_path: Path) -> dict[str, str]:
    """Return the environment of a user who has the package, with a home of the user's own."""
    return having(installed, tmp_path / "home")


@pytest.fixture
def run_yard(
    user: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[str], dict[str, str]]]:
    """Return a function that runs a stack until the test is over, from a folder that has nothing to do with it."""
    monkeypatch.setenv("REGRAFT_HOME", user["REGRAFT_HOME"])
    with ExitStack() as running:

        def start(stack: str) -> dict[str, str]:
            words = ("up", stack, "--headless", "--system", "yard")
            command = started(user, *words, log=tmp_path / "up.log", cwd=tmp_path)
            running.callback(_end, command)
            wait_until(lambda: command.process.poll() is not None or run_directory.running(), "the stack to be up")
            command.must_run()
            return user

        yield start


def _end(command: Command) -> None:
    assert command.end() in (0, 130)


def shown(user: dict[str, str], *words: str) -> str:
    """Return what a command prints about the running stack."""
    done = regraft(user, "--system", "yard", *words, "--json")
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_each_robot_has_the_device_on_a_topic_of_its_own_and_turns_by_it(
    run_yard: Callable[[str], dict[str, str]],
) -> None:
    running = run_yard("acme_yard")
    topics = json.loads(shown(running, "topic", "list", "--robot", "north"))["topics"]
    heading = next(topic for topic in topics if topic["name"] == "north/heading")
    assert (heading["type"], heading["writers"]) == ("acme/Heading", ["world.north/heading"])
    assert heading["readers"] == ["north.turner.heading"]
    for robot, direction in (("north", 1.5), ("south", -1.5)):

        def arrived(robot: str = robot, direction: float = direction) -> bool:
            seen = json.loads(shown(running, "topic", "echo", f"{robot}/heading", "--count", "1"))
            return math.isclose(seen["message"]["yaw"], direction, abs_tol=0.1)

        wait_until(arrived, f"{robot} to have turned")


def test_a_robot_that_has_devices_alone_is_known_by_its_name(
    installed: Path, run_yard: Callable[[str], dict[str, str]], tmp_path: Path
) -> None:
    stack = tmp_path / "yard.yaml"
    watcher = "{robot: acme_rover, place: {x: -1.0, y: 0.0}, components: {turner: null}}"
    stack.write_text(f"include: [{installed}/acme_rover/yard/stack.yaml]\nrobots:\n  watcher: {watcher}\n")
    running = run_yard(str(stack))
    topics = json.loads(shown(running, "topic", "list", "--robot", "watcher"))["topics"]
    assert [topic["name"] for topic in topics] == ["watcher/heading", "watcher/velocity"]
    done = regraft(running, "--system", "yard", "topic", "list", "--robot", "wacher")
    assert (done.returncode, "did you mean 'watcher'?" in done.stderr) == (2, True)


def failed(user: dict[str, str], tmp_path: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Run the stack for a few seconds, in which north's compass fails."""
    return regraft(user, "up", "acme_yard", *SHORT, "--set", FAILING, *options, cwd=tmp_path)


def test_the_device_fails_by_schedule_as_its_parameter_says(user: dict[str, str], tmp_path: Path) -> None:
    done = failed(user, tmp_path, "--set", "world.north/compass_bias=0.8")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["reproducible"] is True
    logs = {name: shown(user, "logs", f"{name}.turner") for name in ("north", "south")}
    assert "the compass jumps by 0.8 rad at 3.0 s" in logs["north"]
    assert "jumps" not in logs["south"]


@pytest.mark.parametrize(
    ("setting", "problem"),
    [
        ("world.north/compass_bais=1", "did you mean 'north/compass_bias'?"),
        ("world.north/compass_noise=-1", "must be at least 0.0 rad"),
        ("world.failures=[{at: 3, device: compass, failure: bias}]", "there is no device 'compass' that can fail"),
        ("world.failures=[{at: 3, device: north/compass, failure: dropout}]", "none, silent, frozen, bias"),
    ],
)
def test_a_wrong_setting_of_the_device_is_refused(
    user: dict[str, str], tmp_path: Path, setting: str, problem: str
) -> None:
    done = regraft(user, "up", "acme_yard", *SHORT, "--set", setting, cwd=tmp_path)
    assert done.returncode == 2
    assert problem in done.stderr
    assert "is required" not in done.stderr
