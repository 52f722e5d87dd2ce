"""Changes of a mission are recorded to a file, and shown again from it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.messages.mission import (
    Command,
    MissionNode,
    MissionTransition,
    MissionTransitions,
    NodeStatus,
)
from regraft.services.bt_executor.observing import recording
from regraft.services.bt_executor.observing.recording import Recording, Unreadable, steps
from regraft.services.bt_executor.source import Unloadable
from regraft.testing import Rig
from tests.authors.commands import mission, refused
from tests.executor.helpers import command, kinds, run, status, tree

BODY = ('<Script code="n := 1"/>', '<Sleep name="drive" msec="500"/>', '<Sleep name="wait" msec="100000"/>')
IDLE, RUNNING, SUCCESS = NodeStatus.IDLE, NodeStatus.RUNNING, NodeStatus.SUCCESS
STATUSES = st.sampled_from([IDLE, RUNNING, SUCCESS, NodeStatus.FAILURE])
LINE = '{"version":1,"tree":"M","stamp":0.0,"nodes":[[1,0,"a","A","a","idle"]]}\n'


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Record a mission, another one that takes over from it, and its end."""
    path = tmp_path / "run.jsonl"
    with Rig() as rig:
        run(rig, tree(*BODY), record=str(path))
        rig.advance(1.0)
        now, last = status(rig), steps_of(path)[-1]
        assert [node.status for node in last.nodes] == [node.status for node in now.nodes]
        command(rig, Command.SWAP, tree(BODY[2], name="Other"))
        rig.advance(0.5)
        command(rig, Command.HALT)
    return path


def steps_of(path: Path) -> list[recording.Step]:
    """Return all steps of a recording."""
    return list(steps(path))


def test_a_recording_has_every_change_in_its_order(file: Path) -> None:
    found = steps_of(file)
    assert [step.tree for step in found if step.tick == 0 and not step.changes] == ["Main", "Other"]
    changes = [
        (change.uid, change.before, change.after) for step in found if step.tree == "Main" for change in step.changes
    ]
    assert changes[:4] == [(1, IDLE, RUNNING), (2, IDLE, SUCCESS), (3, IDLE, RUNNING), (3, RUNNING, SUCCESS)]
    assert all(node.status is IDLE for node in found[0].nodes)
    assert all(node.status is IDLE for node in found[-1].nodes)


def test_a_recording_that_begins_later_knows_the_statuses_before(tmp_path: Path) -> None:
    path = tmp_path / "late.jsonl"
    with Rig() as rig:
        executor = run(rig, tree(*BODY))
        rig.advance(0.3)
        executor.kit.parameters.set({"record": str(path)})
        executor.on_parameters(frozenset({"record"}))
        rig.advance(0.5)
    first, second = steps_of(path)[:2]
    assert [node.status for node in first.nodes] == [RUNNING, SUCCESS, RUNNING, IDLE]
    assert [node.status for node in second.nodes] == [RUNNING, SUCCESS, SUCCESS, RUNNING]


def test_a_file_that_cannot_be_written_ends_the_recording_and_not_the_mission(tmp_path: Path) -> None:
    with Rig() as rig:
        run(rig, tree(*BODY), record=str(tmp_path / "nowhere" / "run.jsonl"))
        rig.advance(1.0)
        assert "cannot be written" in next(event.text for event in rig.events if event.kind == "mission.recorded")
        assert kinds(rig).count("mission.recorded") == 1
        assert status(rig).running == ("wait",)


@pytest.mark.parametrize("name", ["x" * 300, "a\0b"])
def test_a_file_that_cannot_be_ends_the_recording_and_not_the_mission(tmp_path: Path, name: str) -> None:
    with Rig() as rig:
        run(rig, tree(*BODY), record=str(tmp_path / name))
        rig.advance(1.0)
        assert kinds(rig).count("mission.recorded") == 1
        assert status(rig).running == ("wait",)
        assert command(rig, Command.SWAP, tree(BODY[2], name="Other")).tree == "Other"


def test_a_mission_that_is_refused_begins_no_recording(tmp_path: Path) -> None:
    earlier, later = tmp_path / "earlier.jsonl", tmp_path / "later.jsonl"
    with Rig() as rig:
        executor = run(rig, tree(*BODY), record=str(earlier))
        executor.kit.parameters.set({"record": str(later), "mission": str(tmp_path / "nowhere.xml")})
        with pytest.raises(Unloadable):
            executor.on_parameters(frozenset({"record", "mission"}))
        rig.advance(1.0)
    assert steps_of(earlier)
    assert not later.exists()


def test_a_file_that_is_no_recording_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("do not lose me\n")
    with Rig() as rig:
        run(rig, tree(*BODY), record=str(path))
        rig.advance(1.0)
        assert status(rig).state.value == "running"
        assert "mission.recorded" in kinds(rig)
    assert path.read_text() == "do not lose me\n"


def test_an_earlier_recording_is_replaced(file: Path) -> None:
    with Rig() as rig:
        run(rig, tree(BODY[2], name="Later"), record=str(file))
        rig.advance(0.5)
    assert {step.tree for step in steps_of(file)} == {"Later"}


def test_a_full_file_ends_the_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "MAX_SIZE", 600)
    path, told = tmp_path / "run.jsonl", list[str]()
    full = Recording(path, told.append)
    nodes = (MissionNode(1, 0, "a", "A", "a", IDLE),)
    for tick in range(1, 20):
        full.write("M", nodes, MissionTransitions(tick, "s", tick, (MissionTransition(1, IDLE, RUNNING, tick),)))
    assert path.stat().st_size <= 600
    assert told == [f"the recording ends: '{path}' is full: must have at most 600 characters"]
    assert 2 < len(list(steps(path))) < 19


def test_a_step_of_which_changes_are_missed_has_the_statuses_behind_it(tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    written = Recording(path, print)

    def write(tick: int, after: NodeStatus, *changes: MissionTransition) -> None:
        nodes = tuple(MissionNode(uid, uid - 1, f"n{uid}", "N", f"p/{uid}", after) for uid in (1, 2))
        written.write("M", nodes, MissionTransitions(float(tick), "s", tick, changes, 2 - len(changes)))

    write(1, RUNNING, MissionTransition(1, IDLE, RUNNING, 1.0), MissionTransition(2, IDLE, RUNNING, 1.0))
    write(2, IDLE, MissionTransition(1, RUNNING, IDLE, 2.0))
    assert [[node.status for node in step.nodes] for step in steps_of(path)] == [
        [IDLE, IDLE],
        [RUNNING, RUNNING],
        [IDLE, IDLE],
    ]


@given(st.lists(st.lists(st.tuples(st.integers(1, 3), STATUSES), max_size=4), max_size=6))
def test_what_is_read_again_is_what_was_written(batches: list[list[tuple[int, NodeStatus]]]) -> None:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.jsonl"
        written, now = Recording(path, print), dict.fromkeys((1, 2, 3), IDLE)
        expected = []
        for tick, batch in enumerate(batches, start=1):
            changes = []
            for uid, after in batch:
                changes.append(MissionTransition(uid, now[uid], after, tick / 2))
                now[uid] = after
            nodes = tuple(MissionNode(uid, uid - 1, f"n{uid}", "N", f"p/{uid}", now[uid]) for uid in (1, 2, 3))
            written.write("M", nodes, MissionTransitions(float(tick), "s", tick, tuple(changes)))
            expected.append((tick, tuple(changes), nodes))
        if expected:
            assert [(step.tick, step.changes, step.nodes) for step in steps(path)][1:] == expected


def test_every_change_is_shown_with_its_time(file: Path) -> None:
    lines = mission("replay", file).stdout.splitlines()
    assert "Main, 4 nodes" in lines[0]
    assert any(line.endswith("drive (Sleep): running -> success") for line in lines)
    documents = [json.loads(line) for line in mission("replay", file, "--json").stdout.splitlines()]
    assert documents[1]["changes"][0]["path"] == "Sequence::1"
    assert len(documents) == len(steps_of(file))


def test_the_tree_is_shown_at_a_time_and_after_a_tick(file: Path) -> None:
    found = steps_of(file)
    at = mission("replay", file, "--at", found[1].stamp).stdout.splitlines()
    assert at[0].startswith("Main at ")
    assert ">   drive (Sleep)  running" in at
    done = next(step for step in found if step.nodes[2].status is SUCCESS)
    later = json.loads(mission("replay", file, "--at", done.stamp, "--json").stdout)
    assert later["nodes"][2]["status"] == "success"
    after = json.loads(mission("replay", file, "--tick", 1, "--json").stdout)
    assert (after["tree"], after["tick"], after["changes"][0]["after"]) == ("Other", 1, "running")


def test_it_is_shown_step_by_step_until_it_ends_or_q_is_typed(file: Path) -> None:
    whole = mission("replay", file, "--step", text="\n" * 100).stdout
    assert whole.count(", tick ") == len(steps_of(file))
    assert mission("replay", file, "--step", text="\nq\n").stdout.count(", tick ") == 2
    assert mission("replay", file, "--step", text="").stdout.count(", tick ") == 1


def test_a_time_or_a_tick_that_there_is_not_is_refused(file: Path) -> None:
    assert "--tick 900: there is no such tick" in refused("replay", file, "--tick", 900)
    lines = file.read_text().splitlines()
    lines[0] = lines[0].replace('"stamp":0.0', '"stamp":5.0')
    file.write_text("\n".join(line.replace('"stamp":0.0', '"stamp":5.0') for line in lines[:2]))
    assert "--at 1: the recording begins at 5 s and ends at 5 s" in refused("replay", file, "--at", 1)
    assert "exclude each other" in refused("replay", file, "--at", 1, "--step")


WRONG = {
    "nothing": ("", "is empty"),
    "no JSON": ("{", ":1: must be a tree or the changes of a tick"),
    "changes without a tree": ('{"tick":1,"stamp":0,"missed":0,"changes":[]}\n', "changes come before a tree"),
    "another version": ('{"version":2,"tree":"M"}\n', "version is 2, must be 1"),
    "a node that there is not": (LINE + '{"tick":1,"stamp":0,"missed":0,"changes":[[7,"idle","idle",0]]}\n', ":2: "),
    "a status that there is not": (LINE.replace("idle", "idl"), "'idl' is not a valid NodeStatus"),
    "nodes in disorder": (LINE.replace("[1,0", "[2,0"), "node 2 of parent 0 is at place 1"),
    "a list": ("[1]\n", ":1: "),
    "nesting without end": ("[" * 100_000, ":1: "),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_no_recording_is_refused_with_its_line(wrong: str, tmp_path: Path) -> None:
    text, told = WRONG[wrong]
    (tmp_path / "run.jsonl").write_text(text)
    complaint = mission("replay", tmp_path / "run.jsonl")
    assert (complaint.exit_code, told in complaint.stderr) == (2, True), complaint.stderr


def test_a_last_line_that_is_cut_off_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "run.jsonl").write_text(LINE + '{"tick":1,"sta')
    assert len(list(steps(tmp_path / "run.jsonl"))) == 1


def test_a_missing_file_or_a_line_without_end_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "cannot be read" in refused("replay", tmp_path / "nowhere.jsonl")
    monkeypatch.setattr(recording, "MAX_LINE", 100)
    (tmp_path / "run.jsonl").write_text("x" * 101)
    with pytest.raises(Unreadable, match="at most 100 bytes"):
        list(steps(tmp_path / "run.jsonl"))
