"""The metacontroller itself, in a system of processes: reached by commands, over REST and from a tree."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.cli.live import System, regraft
from tests.docs.test_docs import blocks
from tests.executor.helpers import tree
from tests.metacontrol.control.bench import write
from tests.support.machine.processes import kill
from tests.support.paths import ROOT
from tests.support.waiting import wait_for, wait_until

pytestmark = pytest.mark.slow

MORE = """\
  bt_executor: {class: 'regraft.services.bt_executor.executor:Executor'}
  driver: {class: 'tests.executor.robot:Navigator', parameters: {seconds: 3600.0}}
  gateway: {class: 'regraft.dashboard_api.gateway:Gateway', parameters: {port: 0}}
"""
OBJECTIVE = (
    '<Objective name="patrol" skill="to_navigate" requirements="safety >= 0.5, energy: 0.5" task="rounds" '
    'status="{state}" realization_out="{realization}">{}</Objective>'
)
PAGE = ROOT / "docs" / "metacontrol.md"
UNTIL_ENOUGH = (
    '<RetryUntilSuccessful num_attempts="-1"><Sequence><Sleep msec="100"/><ScriptCondition code="enough"/></Sequence>'
    "</RetryUntilSuccessful>"
)
DRIVE = '<NavigateTo name="drive" x="1" y="2"/>'


def stack(folder: Path) -> Path:
    """Write the robot of the published patrol, under the real clock, with an executor and a gateway."""
    file = write(folder)
    lines = [line for line in file.read_text().splitlines() if "world:" not in line and "director:" not in line]
    text = "\n".join(lines).replace("clock: simulated", "clock: real")
    text = text.replace("ticks: {type: modes/Sample}", "mission: {type: regraft/MissionStatus}")
    file.write_text(text.replace("modes: modes.yaml", f"{MORE}modes: modes.yaml\n"))
    return file


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Run the robot."""
    folder = tmp_path_factory.mktemp("robot")
    with System(folder / "home", command=("up", str(stack(folder)), "--headless")) as system:
        yield system


@pytest.fixture
def system(running: System) -> Iterator[System]:
    """Return the robot, without a mission and objectives before and after."""
    yield running
    if running.ask("mission", "show")["state"] in ("running", "paused"):
        running.ask("mission", "halt")
    for each in running.ask("objective", "list")["objectives"]:
        if not each["parent"]:
            regraft(running.home, "objective", "cancel", each["objective"])
    wait_until(lambda: running.ask("objective", "list")["objectives"] == [], "no objectives")


def load(system: System, folder: Path, *nodes: str) -> None:
    """Load and start a mission."""
    file = folder / "mission.xml"
    file.write_text(tree(*nodes))
    system.ask("mission", "load", str(file))
    system.ask("mission", "start")


def board(system: System) -> dict[str, Any]:
    """Return the blackboard."""
    found: dict[str, Any] = system.ask("mission", "show")["blackboard"]
    return found


def test_an_objective_of_a_command_is_provided_explained_and_ended(system: System) -> None:
    added = system.ask("objective", "add", "to_navigate", "safety>=0.5", "energy=0.5", "--name", "patrol")
    assert added["objectives"][0]["realization"] == "normal"
    assert system.components()["controller"]["state"] == "active"
    assert "energy is estimated 0.7, must be <= 0.5" in regraft(system.home, "objective", "explain", "patrol").stdout
    lines = regraft(system.home, "objective", "show", "patrol").stdout.splitlines()
    assert "energy       0.5                 0.5" in lines
    assert regraft(system.home, "objective", "cancel", "patrol").returncode == 0
    assert system.components()["controller"]["state"] == "inactive"


def test_the_commands_on_the_page_show_what_it_shows(system: System) -> None:
    (console,) = blocks(PAGE, "console", "patrol")
    for part in console.split("$ regraft ")[1:]:
        command, *expected = part.splitlines()
        shown = regraft(system.home, *shlex.split(command)).stdout
        assert re.sub(r"for [0-9.]+ m?s", "for 0.2 s", shown).splitlines() == expected


def test_the_body_on_the_page_is_taken(system: System) -> None:
    (body,) = [each for each in blocks(PAGE, "json") if "objectives" in each]
    url = system.ask("ps")["systems"][0]["gateway"]
    created = httpx.post(f"{url}/objectives", json=json.loads(body), timeout=30.0, verify=False)
    assert created.status_code == 201, created.text


def test_a_comparison_against_the_direction_of_its_quality_is_refused_and_is_no_part_of_equality(
    system: System,
) -> None:
    refused = regraft(system.home, "objective", "add", "to_navigate", "safety<=0.5")
    assert refused.returncode == 2
    assert "operators.safety: <= contradicts the direction of 'safety': must be >=" in refused.stderr
    for bound in ("safety=0.5", "safety>=0.5"):
        assert regraft(system.home, "objective", "add", "to_navigate", bound).returncode == 0
    assert len(system.ask("objective", "list")["objectives"]) == 1


def test_an_objective_over_rest_is_provided_and_shown_with_those_that_it_requires(system: System) -> None:
    url = system.ask("ps")["systems"][0]["gateway"]
    with httpx.Client(base_url=url, timeout=30.0, verify=False) as http:
        created = http.post("/objectives", json={"skill": "to_recharge", "name": "dock"})
        assert created.status_code == 201, created.text

        def skills() -> list[str]:
            return [each["skill"] for each in http.get("/objectives/dock").json()["objectives"]]

        wait_until(lambda: skills() == ["to_recharge", "to_navigate"], "the objective that it requires")
        assert http.get("/objectives/dck").status_code == 404
        assert http.post("/objectives/dock/progress", json={"text": "SUCCESS"}).json()["progress"] == "SUCCESS"


def test_a_tree_has_its_objective_while_its_child_is_at_work(system: System, tmp_path: Path) -> None:
    load(system, tmp_path, '<Script code="enough := false"/>', OBJECTIVE.replace("{}", UNTIL_ENOUGH))
    wait_until(lambda: board(system).get("realization") == "normal", "the realization")
    (found,) = system.ask("objective", "list")["objectives"]
    assert (found["objective"], found["task"], found["requirements"]) == (
        "patrol",
        "rounds",
        {"safety": 0.5, "energy": 0.5},
    )
    system.ask("mission", "set", "enough=true")
    wait_until(lambda: system.ask("mission", "show")["state"] == "succeeded", "the end of the mission")
    wait_until(lambda: system.ask("objective", "list")["objectives"] == [], "the end of the objective")
    wait_until(lambda: system.components()["controller"]["state"] == "inactive", "rest")


def test_a_killed_metacontroller_fails_no_mission_and_is_asked_for_the_same_objective(
    system: System, tmp_path: Path
) -> None:
    load(system, tmp_path, OBJECTIVE.replace("{}", DRIVE))
    wait_until(lambda: "drive" in str(system.ask("mission", "show")["running"]), "the drive")
    before = system.components()["metacontrol"]
    wait_for(lambda: board(system)["state"] == "IN_PROGRESS", "the objective")
    kill(before["pid"])
    system.component_after("metacontrol", before["incarnation"])

    def is_owned() -> bool:
        (found,) = system.ask("objective", "list")["objectives"] or ({"state": ""},)
        return found["state"] == "IN_PROGRESS" and system.ask("mission", "show")["state"] == "running"

    wait_until(is_owned, "the objective again")
    system.ask("mission", "halt")
    wait_until(lambda: system.ask("objective", "list")["objectives"] == [], "the end of the objective")
