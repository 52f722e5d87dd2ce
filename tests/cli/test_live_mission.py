"""The commands of a mission, to an executor that runs as a process of its own."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.live import System, regraft
from tests.executor.helpers import tree

pytestmark = pytest.mark.slow

WAIT = '<Sleep name="wait" msec="100000000"/>'


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Run an executor without a stack."""
    run = ("run", "regraft.services.bt_executor.executor:Executor", "--name", "bt_executor")
    with System(tmp_path_factory.mktemp("home"), command=run, ready="bt_executor runs") as system:
        system.component_after("bt_executor", 0)
        yield system


@pytest.fixture
def patrol(alone: System, tmp_path: Path) -> Path:
    """Load and start a tree that counts and then waits; returns its file."""
    file = tmp_path / "patrol.xml"
    file.write_text(tree('<Script code="rounds := 3"/>', WAIT, name="Patrol"))
    assert alone.ask("mission", "load", str(file))["state"] == "loaded"
    assert alone.ask("mission", "start")["state"] == "running"
    return file


def test_a_mission_is_shown_paused_stepped_and_halted(alone: System, patrol: Path) -> None:
    paused = alone.ask("mission", "pause")
    assert alone.ask("mission", "step")["ticks"] == paused["ticks"] + 1
    shown = regraft(alone.home, "mission", "show").stdout.splitlines()
    assert shown[0].startswith("mission Patrol paused")
    assert ">   wait (Sleep)  running" in shown
    assert "  rounds = 3" in shown
    assert alone.ask("mission", "status")["tree"] == "Patrol"
    assert alone.ask("mission", "halt")["state"] == "halted"
    again = regraft(alone.home, "mission", "halt")
    assert again.returncode == 1
    assert "nothing to halt" in again.stderr


def test_the_blackboard_is_read_and_written(alone: System, patrol: Path) -> None:
    alone.ask("mission", "pause")
    alone.ask("mission", "step")
    assert alone.ask("mission", "set", "rounds", "4")["entries"][0]["value"] == 4
    assert [e["value"] for e in alone.ask("mission", "set", "rounds=5", "place=north")["entries"]] == [5, "north"]
    (entry,) = alone.ask("mission", "get", "rounds")["entries"]
    assert (entry["value"], entry["type"]) == (5, "int")
    assert "place" in regraft(alone.home, "mission", "get").stdout
    refused = regraft(alone.home, "mission", "set", "rounds=many", "place=south")
    assert refused.returncode == 2
    assert "'many' is not a whole number" in refused.stderr
    assert alone.ask("mission", "get", "place")["entries"][0]["value"] == "north"
    assert regraft(alone.home, "mission", "get", "nothing").returncode == 2
    assert regraft(alone.home, "mission", "set", "a=1", "a=2").returncode == 2


def test_another_tree_takes_over_and_a_bad_one_does_not(alone: System, patrol: Path) -> None:
    bad = patrol.with_name("bad.xml")
    bad.write_text(tree("<Unknown/>"))
    refused = regraft(alone.home, "mission", "swap", str(bad))
    assert refused.returncode == 2
    assert f"{bad}:2: unknown node type 'Unknown'" in refused.stderr
    assert alone.ask("mission", "show")["tree"] == "Patrol"
    home = patrol.with_name("home.xml")
    home.write_text(tree(WAIT, name="Home"))
    swapped = alone.ask("mission", "swap", str(home))
    assert (swapped["tree"], swapped["state"], swapped["running"]) == ("Home", "running", ["wait"])
    assert regraft(alone.home, "mission", "swap", "nowhere.xml").returncode == 2


def test_a_mission_stops_at_a_breakpoint_and_goes_on_as_told(alone: System, patrol: Path) -> None:
    alone.ask("mission", "halt")
    assert alone.ask("mission", "break", "wait")["breakpoints"][0]["node"] == "wait"
    forced = alone.ask("mission", "break", "Script", "--after", "--result", "success", "--once")
    assert [(each["node"], each["position"]) for each in forced["breakpoints"]] == [
        ("Script::2", "after"),
        ("wait", "before"),
    ]
    assert alone.ask("mission", "next")["stop"]["node"] == "Sequence::1"
    assert alone.ask("mission", "continue")["stop"]["node"] == "wait"
    shown = regraft(alone.home, "mission", "show").stdout
    assert shown.startswith("mission Patrol paused, 1 ticks, stopped before wait\n")
    assert "wait  before" in regraft(alone.home, "mission", "breakpoints").stdout
    failed = alone.ask("mission", "continue", "--result", "failure")
    assert (failed["state"], failed["stop"]) == ("failed", None)
    assert alone.ask("mission", "clear", "wait")["breakpoints"] == []
    assert regraft(alone.home, "mission", "clear").stdout == "no breakpoints\n"
    again = regraft(alone.home, "mission", "continue")
    assert (again.returncode, "has not stopped" in again.stderr) == (1, True)
