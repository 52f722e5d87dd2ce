"""Counts, recordings and a library of trees, on an executor that runs as a process of its own."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.cli.live import System, regraft
from tests.executor.helpers import tree
from tests.support.waiting import wait_for

pytestmark = pytest.mark.slow

WAIT = '<Sleep name="wait" msec="100000000"/>'
AGAIN = '<KeepRunningUntilFailure><Script name="count" code="rounds += 1"/></KeepRunningUntilFailure>'


@pytest.fixture(scope="module")
def trees(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a library with two trees, of which one uses the other, and a third that cannot be loaded."""
    folder = tmp_path_factory.mktemp("trees")
    (folder / "patrol.xml").write_text(
        tree('<Script code="rounds := 0"/>', '<SubTree ID="Round" rounds="{rounds}"/>', name="Patrol")
    )
    (folder / "round.xml").write_text(tree(AGAIN, name="Round"))
    (folder / "home.xml").write_text(tree(WAIT, name="Home"))
    (folder / "broken.xml").write_text(tree("<Unknown/>", name="Broken"))
    return folder


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory, trees: Path) -> Iterator[System]:
    """Run an executor with the library, without a stack."""
    executor = "regraft.services.bt_executor.executor:Executor"
    run = ("run", executor, "--name", "bt_executor", "--set", f"trees={trees}")
    with System(tmp_path_factory.mktemp("home"), command=run, ready="bt_executor runs") as system:
        system.component_after("bt_executor", 0)
        yield system


@pytest.fixture
def patrol(alone: System) -> System:
    """Load and start a tree of the library by its ID."""
    assert alone.ask("mission", "load", "--main", "Patrol")["state"] == "loaded"
    assert alone.ask("mission", "start")["tree"] == "Patrol"
    return alone


def documents(system: System, *arguments: str) -> list[dict[str, Any]]:
    """Return the JSON lines that a command printed."""
    done = regraft(system.home, *arguments, "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_counts_are_shown_as_soon_as_the_parameter_is_set_and_no_more_without_it(patrol: System) -> None:
    assert "set the parameter 'counts' to true" in regraft(patrol.home, "mission", "show", "--counts").stderr
    patrol.ask("param", "set", "bt_executor", "counts=true")

    def counted() -> list[dict[str, Any]] | None:
        nodes: list[dict[str, Any]] = patrol.ask("mission", "show", "--counts")["nodes"]
        assert [node["uid"] for node in nodes] == list(range(1, 7))
        return nodes if nodes[-1]["successes"] > 3 else None

    nodes = wait_for(counted, "some rounds")
    assert nodes[-1]["ticks"] == nodes[-1]["successes"]
    shown = regraft(patrol.home, "mission", "show", "--counts").stdout
    assert "mission Patrol running" in shown
    assert "count (Script)" in shown
    patrol.ask("param", "set", "bt_executor", "counts=false")
    assert regraft(patrol.home, "mission", "show", "--counts").returncode != 0


def test_what_is_recorded_while_a_mission_runs_is_replayed_also_before_the_recording_ends(
    patrol: System, tmp_path: Path
) -> None:
    file = tmp_path / "run.jsonl"
    patrol.ask("param", "set", "bt_executor", f"record={file}")
    wait_for(lambda: file.exists() and len(file.read_text().splitlines()) > 4, "some ticks to be recorded")
    assert "count (Script)" in regraft(patrol.home, "mission", "replay", str(file), "--step").stdout
    assert patrol.ask("mission", "swap", "--main", "Home")["running"] == ["wait"]
    patrol.ask("param", "set", "bt_executor", "record=''")
    recorded = documents(patrol, "mission", "replay", str(file))
    text = regraft(patrol.home, "mission", "replay", str(file)).stdout
    assert [line["tree"] for line in recorded if line["tick"] == 0] == ["Patrol", "Home"]
    assert "Patrol, 6 nodes" in text
    assert "wait (Sleep): idle -> running" in text
    last = patrol.ask("mission", "replay", str(file), "--at", str(recorded[-1]["stamp"]))
    shown = patrol.ask("mission", "show")["nodes"]
    assert [(node["path"], node["status"]) for node in last["nodes"]] == [
        (node["path"], node["status"]) for node in shown
    ]


def test_trees_of_the_library_are_checked_loaded_and_swapped_in_by_their_ids(patrol: System, trees: Path) -> None:
    library = ("--trees", str(trees))
    for name, nodes in (("Patrol", 6), ("Home", 2)):
        file = trees / f"{name.lower()}.xml"
        checked = patrol.ask("mission", "check", str(file), "--main", name, *library)
        assert (checked["tree"], checked["nodes"], checked["errors"]) == (name, nodes, [])
    assert patrol.ask("mission", "swap", "--main", "Home")["tree"] == "Home"
    assert patrol.ask("mission", "load", "--main", "Round")["tree"] == "Round"
    own = trees.parent / "own.xml"
    own.write_text(tree('<SubTree ID="Home"/>', name="Own"))
    assert patrol.ask("mission", "check", str(own), "--main", "Own", *library)["errors"] == []
    assert patrol.ask("mission", "load", str(own), "--main", "Own")["tree"] == "Own"


@pytest.mark.parametrize("verb", ["load", "swap"])
@pytest.mark.parametrize(
    ("wanted", "complaint"), [("Ptrol", "did you mean 'Patrol'"), ("Broken", "unknown node type 'Unknown'")]
)
def test_a_tree_that_the_library_cannot_give_is_refused_and_the_mission_continues(
    patrol: System, verb: str, wanted: str, complaint: str
) -> None:
    refused = regraft(patrol.home, "mission", verb, "--main", wanted)
    assert refused.returncode == 2
    assert complaint in refused.stderr
    before = patrol.ask("mission", "show")
    assert (before["tree"], before["state"]) == ("Patrol", "running")
    wait_for(lambda: patrol.ask("mission", "show")["ticks"] > before["ticks"], "the next tick")
