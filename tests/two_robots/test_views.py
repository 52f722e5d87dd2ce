"""Two robots as their operators see them: each mission, component and topic by the name of its robot."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.messages.mission import MissionRequest, MissionState, MissionStatus
from tests.cli.live import Done, regraft
from tests.support.commands import Command
from tests.support.frog import Frog
from tests.support.paths import TWO_ROBOTS
from tests.support.systems import home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow


def run(*words: str) -> Done:
    """Run a command in this process."""
    return regraft(Path(os.environ["REGRAFT_HOME"]), *words)


def shown(*words: str) -> dict[str, Any]:
    """Return the JSON that a command prints."""
    done = run(*words, "--json")
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def names(found: list[dict[str, Any]]) -> set[str]:
    return {each["name"] for each in found}


@pytest.fixture(scope="module")
def frog(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Frog]:
    """Return two robots whose missions run; every test leaves them as they were."""
    folder = tmp_path_factory.mktemp("frog")
    with home(folder / "home"):
        frog = Frog(folder, "--speed", "real", stack=TWO_ROBOTS)
        yield frog
        frog.end()


def test_each_robot_is_seen_and_commanded_by_its_name(frog: Frog) -> None:
    without = run("mission", "halt")
    assert without.returncode == 2
    assert "several robots run missions: rescuer, scout: name one of them with --robot" in without.stderr
    wrong = run("mission", "show", "--robot", "skout")
    assert (wrong.returncode, "did you mean 'scout'?" in wrong.stderr) == (2, True)
    assert shown("mission", "pause", "--robot", "scout")["state"] == "paused"
    assert shown("mission", "show", "--robot", "rescuer")["state"] == "running"
    assert frog.rest.get("/mission", params={"robot": "scout"}).json()["state"] == "paused"
    problem = frog.rest.get("/mission").json()
    assert (problem["status"], problem["violations"][0]["field"]) == (422, "robot")
    shown("mission", "set", "hits=7", "--robot", "rescuer")
    assert (
        frog.rest.get("/mission/blackboard", params={"robot": "rescuer", "key": "hits"}).json()["entries"][0]["value"]
        == 7
    )
    assert shown("mission", "start", "--robot", "scout")["state"] == "running"


def test_lists_show_what_belongs_to_one_robot(frog: Frog) -> None:
    own = ("battery", "bt_executor", "camera", "detector", "map_server", "navigator", "recorder")
    components = {f"scout.{name}" for name in own}
    (system,) = shown("ps", "--robot", "scout")["systems"]
    assert names(system["components"]) == components
    assert names(frog.rest.get("/components", params={"robot": "scout"}).json()["components"]) == components
    topics = names(shown("topic", "list", "--robot", "scout")["topics"])
    assert {"scout/scan", "scout/mission", "world_state"} <= topics
    assert not any(topic.startswith("rescuer/") for topic in topics)
    listed = names(frog.rest.get("/topics", params={"robot": "scout"}).json()["topics"])
    assert listed == {topic for topic in topics if topic not in ("scout/mission/transitions",)}
    actions = shown("action", "list", "--robot", "rescuer")["actions"]
    assert names(actions) == {"rescuer/navigate_to"}
    assert frog.rest.get("/components", params={"robot": "scuot"}).status_code == 404


def test_a_component_that_joins_a_robot_asks_and_serves_by_its_names(frog: Frog, tmp_path: Path) -> None:
    shown("mission", "pause", "--robot", "scout")
    words = ("run", "tests.two_robots.parts:Curious", "--join", "tests")
    joined = [Command(*words, "--name", f"{robot}.curious", log=tmp_path / robot) for robot in ("scout", "rescuer")]
    try:
        states = {}
        for robot in ("scout", "rescuer"):
            service = f"{robot}/curious"
            wait_until(partial(frog.client.reaches, service), f"{robot}'s curious one")
            states[robot] = frog.client.call(service, MissionRequest(), MissionStatus, PATIENCE).state
    finally:
        for command in joined:
            command.end()
        shown("mission", "start", "--robot", "scout")
    assert states == {"scout": MissionState.PAUSED, "rescuer": MissionState.RUNNING}
