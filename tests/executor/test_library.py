"""An executor, and commands without a system, know a library of trees."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from regraft import CallFailed
from regraft.bus_schema.messages.mission import Command, MissionState
from regraft.bus_schema.model.lifecycle import State
from regraft.services.bt_executor import source
from regraft.services.bt_executor.executor import Executor
from regraft.services.bt_executor.source import Unloadable, library_of
from regraft.testing import Rig
from tests.authors.commands import mission, refused
from tests.executor.helpers import command, refusal, status, tree

WAIT = '<Sleep name="wait" msec="100000"/>'


@pytest.fixture
def trees(tmp_path: Path) -> Path:
    """Return a folder with two trees, of which one uses the other."""
    folder = tmp_path / "trees"
    folder.mkdir()
    (folder / "patrol.xml").write_text(tree('<SubTree ID="Rest"/>', name="Patrol"))
    (folder / "rest.xml").write_text(tree(WAIT, name="Rest"))
    return folder


def test_a_mission_of_the_library_starts_by_its_id(trees: Path) -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"trees": str(trees), "main": "Patrol"})
        rig.advance(0.5)
        now = status(rig)
        assert (now.tree, now.state, now.running) == ("Patrol", MissionState.RUNNING, ("Rest::2/wait",))


def test_a_tree_of_the_library_is_loaded_checked_and_swapped_in_by_its_id(trees: Path) -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"trees": str(trees)})
        assert command(rig, Command.LOAD, main="Rest").tree == "Rest"
        command(rig, Command.START)
        assert command(rig, Command.CHECK, main="Patrol").tree == "Rest"
        assert command(rig, Command.SWAP, main="Patrol").tree == "Patrol"
        assert command(rig, Command.SWAP, tree('<SubTree ID="Rest"/>', name="Own")).tree == "Own"


def test_a_tree_that_the_library_has_not_is_refused_and_changes_nothing(trees: Path) -> None:
    with Rig() as rig:
        executor = rig.add(Executor, "bt_executor", {"trees": str(trees), "main": "Patrol"})
        rig.advance(0.5)
        with pytest.raises(CallFailed, match="there is no tree 'Rst'"):
            command(rig, Command.SWAP, main="Rst")
        executor.kit.parameters.set({"main": "Ptrol"})
        with pytest.raises(Unloadable, match="did you mean 'Patrol'"):
            executor.on_parameters(frozenset({"main"}))
        assert status(rig).tree == "Patrol"


def test_without_a_file_and_an_id_there_is_nothing_to_load() -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor")
        assert "give its XML or ID" in refusal(rig, Command.LOAD)


def test_a_library_that_is_not_there_keeps_the_component_from_being_configured(tmp_path: Path) -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"trees": str(tmp_path / "nowhere")})
        assert rig.state("bt_executor") is State.UNCONFIGURED
        fault, _ = rig.take_faults()
    assert "there is no such file or folder" in fault


def test_a_package_brings_trees_by_an_entry_point(trees: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entries = [EntryPoint("mine", "somebodys_package.trees", source.TREE_ENTRY_POINTS)]
    monkeypatch.setattr(source, "entry_points", lambda group: entries if group == source.TREE_ENTRY_POINTS else [])
    with pytest.raises(Unloadable, match=r"no package 'somebodys_package\.trees'"):
        library_of([])
    installed = tmp_path / "site"
    installed.mkdir()
    (installed / "somebodys_package").symlink_to(tmp_path)
    monkeypatch.syspath_prepend(str(installed))
    assert library_of([]).ids == ("Patrol", "Rest")


def test_commands_without_a_system_know_the_library(trees: Path, tmp_path: Path) -> None:
    file = tmp_path / "own.xml"
    file.write_text(tree('<SubTree ID="Rest"/>', name="Own"))
    assert "there is no tree 'Rest'" in refused("check", file)
    assert "Own, 4 nodes: nothing wrong" in mission("check", file, "--trees", trees).stdout
    assert 'label="Rest";' in mission("dot", file, "--trees", trees / "rest.xml").stdout
    assert mission("dry-run", file, "--trees", trees, "--for", "200").exit_code == 0
    stack = tmp_path / "stack.yaml"
    executor = "{class: 'regraft.services.bt_executor.executor:Executor', parameters: {trees: trees}}"
    stack.write_text(
        f"system: s\nclock: real\ntopics: {{mission: {{type: regraft/MissionStatus}}}}\ncomponents: {{e: {executor}}}\n"
    )
    assert "Own, 4 nodes: nothing wrong" in mission("check", file, "--stack", stack).stdout
    assert "there is no such file or folder" in refused("check", file, "--trees", tmp_path / "nowhere")
    assert "name a file, or by --main a tree" in refused("load")


def test_a_file_that_nobody_can_read_keeps_nobody_from_the_others(trees: Path) -> None:
    (trees / "far.xml").symlink_to(trees / ("x" * 300))
    library = library_of([str(trees)])
    assert "Patrol" in library.ids
    assert len(library.problems) == 1
