"""Missions from anywhere: whatever the tree, the entry or the rule, there is an answer, and the mission goes on."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from behavior_tree import Blackboard
from regraft import CallFailed
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    Command,
    MissionCounts,
    MissionCountsRequest,
    MissionState,
    MissionStatus,
    WriteBlackboard,
)
from regraft.component.component import describe
from regraft.host.watchdog.hang_detection import HUNG_TIMEOUT
from regraft.services.bt_executor.checking import check, known_nodes
from regraft.services.bt_executor.executor import Executor
from regraft.services.bt_executor.observing.recording import steps
from regraft.services.bt_executor.source import Source, Unloadable
from regraft.testing import Rig
from tests.cli.app import whole
from tests.executor.helpers import command, refusal, run, status, tree

ROOT = '<root BTCPP_format="4" main_tree_to_execute="Main">'
ENDLESS = tree('<Sleep msec="1000000"/>')
SCRIPT = "; ".join(f"x{n} := 1 + 2" for n in range(500))
RULES = "; ".join("x > 1 : b := 3" for _ in range(500))


def used_often(inner: str, times: int) -> str:
    """Return a tree that uses a sub-tree many times: little XML, much work."""
    uses = '<SubTree ID="S"/>' * times
    trees = (
        f'<BehaviorTree ID="Main"><Sequence>{uses}</Sequence></BehaviorTree><BehaviorTree ID="S">{inner}</BehaviorTree>'
    )
    return f"{ROOT}{trees}</root>"


def refused_while_running(xml: str, folder: Path | None = None) -> str:
    """Have a tree rejected as a successor of a running one, which must go on as if nothing had been; returns why."""
    with Rig() as rig:
        if folder is None:
            run(rig, ENDLESS)
        else:
            (folder / "own.xml").write_text(ENDLESS)
            rig.add(Executor, "bt_executor", {"mission": str(folder / "own.xml")})
        rig.advance(0.5)
        before = status(rig)
        why = refusal(rig, Command.SWAP, xml)
        assert status(rig) == before
        assert before.state is MissionState.RUNNING
        assert [event for event in rig.events if event.kind == "component.fault"] == []
        return why


@pytest.mark.parametrize(
    "inner",
    [
        f'<Script code="{SCRIPT}"/>',
        f'<AdaptOnStart subject_location="a" rules="{RULES}"><AlwaysSuccess/></AdaptOnStart>',
        f'<AlwaysSuccess _skipIf="{" + ".join(["1"] * 2000)}"/>',
    ],
    ids=["scripts", "rules", "conditions"],
)
def test_little_xml_that_means_much_work_is_refused_before_the_work(inner: str) -> None:
    assert "counting each use of a sub-tree: at most 250000" in refused_while_running(used_often(inner, 400))


def test_the_executor_counts_as_hung_only_after_the_time_that_the_largest_tree_may_take() -> None:
    assert describe(Executor).handler_timeout > HUNG_TIMEOUT


def test_included_files_count_as_the_trees_own_text(tmp_path: Path) -> None:
    nodes = "<AlwaysSuccess/>" * 20_000
    (tmp_path / "many.xml").write_text(
        f'{ROOT}<BehaviorTree ID="Many"><Sequence>{nodes}</Sequence></BehaviorTree></root>'
    )
    xml = f'{ROOT}<include path="many.xml"/><BehaviorTree ID="Main"><SubTree ID="Many"/></BehaviorTree></root>'
    why = refused_while_running(xml, tmp_path)
    assert f"'{tmp_path / 'many.xml'}' included: at most 250000" in why


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("a" * 5000, "cannot be read: File name too long"),
        ("/dev/zero", "not found"),
        ("/etc/passwd", "/etc/passwd:1: not well-formed"),
        (".", "not found"),
    ],
)
def test_an_include_that_leads_to_no_tree_is_told_with_its_place(tmp_path: Path, path: str, told: str) -> None:
    why = refused_while_running(f'{ROOT}\n<include path="{path}"/>\n</root>', tmp_path)
    assert told in why
    assert why.startswith(("<text>:2: ", "/etc/passwd:1: "))


@pytest.mark.parametrize(
    ("leaf", "told"),
    [
        (f'<Say name="{"x" * 200_000}" text="a"/>', "name has 200000 characters: at most 10000"),
        (f"<{'x' * 200_000}/>", "unknown node type 'xxx"),
        (f'<Repeat num_cycles="{"9" * 9_000}"><AlwaysSuccess/></Repeat>', "is not a whole number of 64 bits"),
    ],
)
def test_a_reason_is_short_however_long_what_it_quotes_is(leaf: str, told: str) -> None:
    why = refused_while_running(tree(leaf))
    assert why.startswith("<text>:2: ")
    assert told in why
    assert len(why) < 1_100


def test_hundreds_of_nested_sub_trees_are_run_shown_recorded_and_kept(tmp_path: Path) -> None:
    inner = [f'<SubTree ID="T{n + 1}" rounds="{{rounds}}"/>' for n in range(331)]
    last = '<Sequence><Script code="rounds := 1"/><Sleep name="rest" msec="1000000"/></Sequence>'
    others = "".join(f'<BehaviorTree ID="T{n}">{body}</BehaviorTree>' for n, body in enumerate([*inner, last]))
    main = '<BehaviorTree ID="Main"><SubTree ID="T0" rounds="{rounds}"/></BehaviorTree>'
    with Rig() as rig:
        executor = run(rig, ENDLESS, counts=True, record=str(tmp_path / "run.jsonl"))
        command(rig, Command.CHECK, f"{ROOT}{main}{others}</root>")
        command(rig, Command.SWAP, f"{ROOT}{main}{others}</root>")
        rig.advance(0.5)
        now = status(rig)
        assert (now.state, len(now.nodes), now.running[0][-5:]) == (MissionState.RUNNING, 335, "/rest")
        assert now.blackboard["rounds"] == 1
        counts = rig.call("mission/counts", MissionCountsRequest(), MissionCounts)
        assert len(counts.nodes) == 335
        assert executor.snapshot()["runs"]
        assert list(steps(tmp_path / "run.jsonl"))[-1].nodes[-1].name == "rest"
        assert command(rig, Command.HALT).state is MissionState.HALTED
        assert [event for event in rig.events if event.kind == "component.fault"] == []


def test_includes_without_end_are_told_with_their_place(tmp_path: Path) -> None:
    for n in range(500):
        (tmp_path / f"c{n}.xml").write_text(f'{ROOT}<include path="c{n + 1}.xml"/></root>')
    why = refused_while_running(f'{ROOT}<include path="c0.xml"/></root>', tmp_path)
    assert why.startswith(f"{tmp_path / 'c99.xml'}:1: ")


def test_a_pipe_or_device_is_no_mission_and_nobody_waits_for_it(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.xml")
    for file in (tmp_path / "pipe.xml", Path("/dev/zero")):
        (found,) = check(file, known_nodes(())).errors
        assert "it is no file" in found.text
        with pytest.raises(Unloadable, match="it is no file"):
            Source(str(file)).load(known_nodes(()).registry, Blackboard())


@pytest.mark.parametrize("verb", ["load", "swap"])
@pytest.mark.parametrize("content", ["", " \n"])
def test_an_empty_file_is_no_tree_and_does_not_mean_the_executors_own(tmp_path: Path, verb: str, content: str) -> None:
    (tmp_path / "empty.xml").write_text(content)
    found = CliRunner().invoke(whole(), ["mission", verb, str(tmp_path / "empty.xml")])
    assert found.exit_code == 2
    assert "empty.xml: is empty" in found.stderr


def test_one_error_is_told_once_and_by_the_files_name(tmp_path: Path) -> None:
    two = '<BehaviorTree ID="A"><AlwaysSuccess/></BehaviorTree>\n' * 2
    (tmp_path / "m.xml").write_text(f'<root BTCPP_format="4">\n{two}</root>')
    (found,) = check(tmp_path / "m.xml", known_nodes(())).errors
    assert str(found).count(f"{tmp_path / 'm.xml'}:") == 2
    (tmp_path / "m.xml").write_text(tree(f'<Script code="{SCRIPT}; {SCRIPT}"/>'))
    (found,) = check(tmp_path / "m.xml", known_nodes(())).errors
    assert (found.line, "at most 10000" in found.text) == (2, True)


@pytest.mark.parametrize("key", ["a\0", "\0", "a\x7f", "\x1bx", " a", "a ", "@a", "a{b", "}", "", "x" * 201])
def test_what_no_tree_could_name_is_no_entry(key: str) -> None:
    with Rig() as rig:
        run(rig, ENDLESS)
        with pytest.raises(CallFailed, match="is no key of a blackboard entry"):
            rig.call("mission/write", WriteBlackboard({"good": 1, key: 1}), BlackboardEntries)
        assert "good" not in status(rig).blackboard


RUNNING, FAILED = MissionState.RUNNING, MissionState.FAILED


@pytest.mark.parametrize(
    ("nodes", "state", "error"),
    [
        (('<Script code="t := -5"/>', '<Sleep msec="{t}"/>'), FAILED, "must be from 0 to 4294967295 milliseconds"),
        (('<Script code="t := 1e30"/>', '<Sleep msec="{t}"/>'), FAILED, "does not fit into 64 bits"),
        (('<LoopInt queue="{unset}" value="{v}"><AlwaysSuccess/></LoopInt>',), FAILED, "entry 'unset': "),
        (('<ScriptCondition code="5 &amp;&amp; 2"/>',), FAILED, "5 is neither true nor false"),
        (
            ("<Script code=\"s := 'xx'\"/>", '<Repeat num_cycles="-1"><Script code="s += s"/></Repeat>'),
            FAILED,
            "at most",
        ),
        (('<Repeat num_cycles="-1"><Script code="a := 1e300 * 1e300"/></Repeat>',), RUNNING, ""),
        (('<RetryUntilSuccessful num_attempts="-1"><AlwaysFailure/></RetryUntilSuccessful>',), RUNNING, ""),
        ((f'<Repeat num_cycles="-1"><Sequence>{"<AlwaysSuccess/>" * 500}</Sequence></Repeat>',), RUNNING, ""),
    ],
)
def test_a_tree_that_is_hostile_only_as_it_runs_ends_at_most_its_own_mission(
    nodes: tuple[str, ...], state: MissionState, error: str
) -> None:
    with Rig() as rig:
        run(rig, tree(*nodes))
        rig.advance(2.0)
        now = status(rig)
        assert now.state is state
        assert error in now.error
        assert [event for event in rig.events if event.kind == "component.fault"] == []
        command(rig, Command.LOAD, ENDLESS)
        assert command(rig, Command.START).state is RUNNING


# --- adapt decorators ---

ADAPT = '<AdaptOnStart name="adapt" {}><AlwaysSuccess/></AdaptOnStart>'
STRATEGY = (
    'adaptation_strategy="ucb1" subject_location="navigator" adaptation_subject="max_velocity" '
    'adaptation_options="0.1;0.2" '
)


@pytest.mark.parametrize(
    ("ports", "told"),
    [
        (f'rules="{"(" * 4_000}1{")" * 4_000} : a.b := 1"', "nested too deeply"),
        (f'rules="{"(" * 50_000}1{")" * 50_000} : a.b := 1"', "characters: at most 10000"),
        (STRATEGY.replace("0.1;0.2", "[" * 9_000), "nested too deeply"),
        (STRATEGY.replace("0.1;0.2", "[" * 50_000), "characters: at most 10000"),
        ('rules="a.b := 1, a.b := 2"', "a.b is to become two things"),
        ('rules="a.b += 1, a.b := 2"', "a.b is to become two things"),
        ('rules="connect a.b to c, connect a.b to d"', "a.b is to become two things"),
        ('rules="a.b += 1 within [3, 1]"', "the lower bound comes first"),
        ('rules="shutdown a"', "is no action; there are: "),
        (STRATEGY + 'planner="a/**"', "port 'planner': 'a/**' cannot be a planner's name"),
        (STRATEGY + 'planner=""', "port 'planner': '' cannot be a planner's name"),
    ],
)
def test_an_adaptation_that_cannot_work_is_refused_with_the_place(ports: str, told: str) -> None:
    why = refused_while_running(tree(ADAPT.format(ports)))
    assert why.startswith("<text>:2: ")
    assert told in why
    assert len(why) < 500


def test_nobody_adapts_more_often_than_a_manager_can_follow() -> None:
    ports = 'rules="a.b += 1" adaptation_period="0.000001"'
    why = refused_while_running(tree(ADAPT.replace("AdaptOnStart", "AdaptPeriodically").format(ports)))
    assert "adaptation_period' is 1e-06 s; it must be at least 0.01 s" in why


def test_steps_in_any_order_on_different_things_are_one_change() -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"autostart": False})
        loaded: MissionStatus = command(
            rig,
            Command.LOAD,
            tree(ADAPT.format('rules="configure a, a.b += 1, a.b -= 2, a.c := 1, connect a.p to t, activate a"')),
        )
        assert loaded.state is MissionState.LOADED
