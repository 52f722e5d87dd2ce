"""A mission file is checked without a system: what is wrong is told, and where."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner, Result

from behavior_tree import NodeSetup, SyncAction
from regraft.bus_schema.messages.mission import Command, MissionState
from regraft.services.bt_executor.checking import check, known_nodes
from regraft.services.bt_executor.executor import Executor
from regraft.stack import load
from regraft.testing import Rig
from tests.cli.app import whole
from tests.executor.helpers import FROG, command, refusal, run, status, tree

MODELS = """<root BTCPP_format="4"><TreeNodesModel>
<Action ID="Gripper"><input_port name="force" type="double"/></Action><Decorator ID="Guard"/>
</TreeNodesModel></root>"""
GRIPPER = tree('<Guard><Gripper force="1.5"/></Guard>')


class Unmakeable(SyncAction):
    """A leaf that cannot be made."""

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        raise KeyError("forgotten")


LARGE = "x" * 90_000
ODD = {
    "much text": (f'<Say text="{LARGE}{LARGE}{LARGE}"/>', "at most 250000"),
    "many nodes": ("<AlwaysSuccess/>" * 15_000, "10000"),
    "a script without end": (f'<Script code="{"1 + " * 50_000}1"/>', "at most 10000"),
    "JSON without end": (
        f"""<CallService service="s" request_type="regraft/Detect" reply_type="regraft/Sightings"
            request='json:{"[" * 50_000}'/>""",
        "at most 10000",
    ),
    "a number without end": (f'<Sleep msec="{"9" * 50_000}"/>', "msec"),
    "a name without end": (f'<Sleep name="{LARGE}" msec="1"/>', "at most 10000"),
    "a port without end": (f'<Say text="{LARGE}"/>', "at most 10000"),
    "a leaf that raises": ("<Unmakeable/>", "KeyError: 'forgotten'"),
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "mission.xml"


def checked(file: Path, *arguments: str) -> Result:
    """Check a file on the command line."""
    return CliRunner().invoke(whole(), ["mission", "check", str(file), *arguments])


def test_a_right_mission_is_said_to_be_right() -> None:
    found = checked(FROG)
    assert found.exit_code == 0
    assert "Frog, 26 nodes: nothing wrong" in found.stdout


@pytest.mark.parametrize("stack", ["stack", "explore", "search", "rounds"])
def test_every_stacks_mission_is_right(stack: str) -> None:
    parameters = load(FROG.parent / f"{stack}.yaml").architecture.components["bt_executor"].parameters
    mission = Path(parameters["mission"])
    assert check(mission, known_nodes(parameters.get("nodes", "").split()), parameters.get("main", "")).errors == ()


def test_all_errors_are_told_with_line_and_node_in_the_order_of_the_file(file: Path) -> None:
    wrong = (
        '<NavigateTo name="drive" x="here" y="0"/>',
        '<Detct hits="{hits}"/>',
        "<Inverter><AlwaysSuccess/><AlwaysSuccess/></Inverter>",
        '<Script code="a := := 1"/><Bad/><Bad/>',
        '<SubTree ID="Gone"/>',
        '<Parallel name="both" success_count="{n}" failure_count="x"><AlwaysSuccess/></Parallel>',
        '<WaitForTopic input="gols"/>',
        '<Sleep msec="{n}" _onSucces="b := 1"/>',
    )
    file.write_text(tree(*wrong))
    found = checked(file, "--json")
    assert found.exit_code == 2
    report = json.loads(found.stdout)
    assert [error["line"] for error in report["errors"]] == [2, 3, 4, 5, 5, 6, 7, 8]
    assert {error["file"] for error in report["errors"]} == {str(file)}
    texts = [error["text"] for error in report["errors"]]
    for part, text in zip(
        (
            "'here' is not a number",
            "did you mean 'Detect'?",
            "exactly 1 child",
            "'Bad'",
            ":=",
            "'Gone'",
            "'x'",
            "'gols'",
        ),
        texts,
        strict=True,
    ):
        assert part in text
    assert report["errors"][0]["node"] == "drive"
    assert [warning for warning in report["warnings"] if f"{file}:9:" in warning]


def test_node_types_are_known_by_their_models(file: Path) -> None:
    file.write_text(GRIPPER)
    unknown = checked(file)
    assert unknown.exit_code == 2
    assert "--nodes" in unknown.stderr
    models = file.with_name("models.xml")
    models.write_text(MODELS)
    assert checked(file, "--nodes", str(models)).exit_code == 0
    file.write_text(GRIPPER.replace("1.5", "strong"))
    assert "'strong' is not a number" in checked(file, "--nodes", str(models)).stderr


def test_a_node_that_nobody_can_pause_is_a_warning_at_its_line_and_when_it_is_loaded(file: Path) -> None:
    pausable = '<PauseResumeController name="on" pause_service_name="/pause" resume_service_name="/resume">{}{}'
    xml = tree(pausable.format("<AlwaysSuccess/>", "</PauseResumeController>"))
    file.write_text(xml)
    result = checked(file)
    assert result.exit_code == 0
    assert f"warning: {file}:2: " in result.output
    with Rig() as rig:
        run(rig, xml)
        assert [len(event.details["warnings"]) for event in rig.events if event.kind == "mission.loaded"] == [1]


def test_a_default_that_a_model_cannot_mean_is_a_warning_at_the_model_s_line(file: Path) -> None:
    file.write_text(GRIPPER)
    models = file.with_name("models.xml")
    port = '<input_port name="reach" type="double" default="numeric_limits::max()"/>'
    models.write_text(MODELS.replace('<Action ID="Gripper">', f'<Action ID="Gripper">\n{port}'))
    result = checked(file, "--nodes", str(models))
    assert result.exit_code == 0
    assert f"warning: {models}:3: the default of port 'reach'" in result.output


ADAPT = '<AdaptOnStart name="a" rules="n.x := 1">{}</AdaptOnStart>'


@pytest.mark.parametrize(
    ("body", "parent"),
    [
        ("<ReactiveSequence name='r'>{a}<Sleep msec='9'/></ReactiveSequence>", "'r' (ReactiveSequence)"),
        ("<ReactiveFallback><Inverter>{a}</Inverter><Sleep msec='9'/></ReactiveFallback>", "(ReactiveFallback)"),
        ("<WhileDoElse><Sequence>{a}</Sequence><Sleep msec='9'/></WhileDoElse>", "(WhileDoElse)"),
        ("<ReactiveSequence><Sleep msec='9'/>{a}</ReactiveSequence>", ""),
        ("<ReactiveSequence><RunOnce>{a}</RunOnce><Sleep msec='9'/></ReactiveSequence>", ""),
        ("<ReactiveSequence>{slow}<Sleep msec='9'/></ReactiveSequence>", ""),
        ("<WhileDoElse><AlwaysSuccess/>{a}</WhileDoElse>", ""),
        ("<Sequence>{a}<Sleep msec='9'/></Sequence>", ""),
    ],
)
def test_decorators_that_adapt_at_each_tick_are_warned_of(file: Path, body: str, parent: str) -> None:
    at_once, slow = ADAPT.format("<AlwaysSuccess/>"), ADAPT.format("<Sleep msec='9'/>")
    file.write_text(tree(body.format(a=at_once, slow=slow)))
    result = checked(file)
    assert result.exit_code == 0
    assert ("AdaptOnStart 'a' adapts at each tick" in result.output) == bool(parent)
    assert parent in result.output
    if parent:
        assert f"warning: {file}:2: " in result.output


def test_a_model_of_somebody_else_s_node_goes_before_ours_of_the_same_name(file: Path) -> None:
    file.write_text(tree('<Detect service_name="/detect_object" objects="{objects}"/>'))
    assert checked(file).exit_code == 2
    models = file.with_name("models.xml")
    ports = '<input_port name="service_name"/><output_port name="objects"/>'
    models.write_text(
        f'<root BTCPP_format="4"><TreeNodesModel><Action ID="Detect">{ports}</Action></TreeNodesModel></root>'
    )
    assert checked(file, "--nodes", str(models)).exit_code == 0


def test_node_types_are_known_by_their_classes(file: Path) -> None:
    file.write_text(tree('<Takes place="{place}" numbers="1;two"/>'))
    found = checked(file, "--nodes", "tests.executor.test_blackboard:Takes")
    assert found.exit_code == 2
    assert "'two'" in found.stderr


@pytest.mark.parametrize("nodes", ["nowhere:Leaf", "regraft:Component", "nonsense", "missing.xml", "{empty}"])
def test_places_of_node_types_that_lead_nowhere_are_told(file: Path, nodes: str) -> None:
    file.write_text(GRIPPER)
    empty = file.with_name("empty.xml")
    empty.write_text('<root BTCPP_format="4"/>')
    found = checked(file, "--nodes", nodes.format(empty=empty))
    assert found.exit_code == 2
    assert "Traceback" not in found.output
    assert nodes.format(empty=empty) in found.stderr


@pytest.mark.parametrize("text", ["", "<root", "<tree/>", "\xff", '<root BTCPP_format="4"/>'])
def test_what_is_no_tree_at_all_is_told(file: Path, text: str) -> None:
    file.write_text(text, encoding="latin-1")
    found = checked(file)
    assert found.exit_code == 2
    assert str(file) in found.stderr
    assert "Traceback" not in found.output


def test_a_missing_file_and_a_missing_tree_are_told(file: Path) -> None:
    assert "cannot read" in checked(file).stderr
    file.write_text(tree("<AlwaysSuccess/>"))
    assert "'Other'" in checked(file, "--main", "Other").stderr


def test_an_error_in_an_included_file_names_that_file(file: Path) -> None:
    (file.parent / "part.xml").write_text(tree("<Unknown/>", name="Part"))
    main = tree('<SubTree ID="Part"/>')
    included = main.replace('<BehaviorTree ID="Main">', '<include path="part.xml"/><BehaviorTree ID="Main">')
    file.write_text(included.replace('"4">', '"4" main_tree_to_execute="Main">'))
    assert "part.xml:2: " in checked(file).stderr


WRONG = (
    "<Unknown/>",
    '<Sleep msec="soon"/>',
    '<Script code="1 +"/>',
    '<Say txt="x"/>',
    '<SubTree ID="Nope"/>',
    "<Inverter/>",
)
RIGHT = ("<AlwaysSuccess/>", '<Sleep msec="5"/>', '<Inverter><Say text="a &gt; b"/></Inverter>')


@settings(deadline=None, max_examples=30)
@given(lines=st.lists(st.sampled_from((*WRONG, *RIGHT)), min_size=1, max_size=12))
def test_exactly_the_wrong_lines_are_told(tmp_path_factory: pytest.TempPathFactory, lines: list[str]) -> None:
    mission = tmp_path_factory.mktemp("check") / "mission.xml"
    mission.write_text(tree(*lines))
    found = check(mission, known_nodes(()))
    assert [error.line for error in found.errors] == [n for n, line in enumerate(lines, 2) if line in WRONG]


def test_types_of_the_executors_own_entries_are_checked(file: Path) -> None:
    file.write_text(tree('<Takes place="{battery_charge}"/>'))
    assert "battery_charge" in checked(file, "--nodes", "tests.executor.test_blackboard:Takes").stderr


@pytest.mark.parametrize(
    ("node", "known_to_all"), [('<WaitForTopic input="odometry"/>', False), ('<Takes place="{robot_speed}"/>', True)]
)
def test_the_executor_of_a_stack_decides_what_is_right_there(file: Path, node: str, known_to_all: bool) -> None:
    """An executor that navigates has an input of its own, and an entry that is a number."""
    file.write_text(tree(node))
    nodes = ("--nodes", "tests.executor.test_blackboard:Takes")
    assert (checked(file, *nodes).exit_code == 0) is known_to_all
    assert (checked(file, *nodes, "--stack", str(FROG.parent / "nav2.yaml")).exit_code == 0) is not known_to_all


def test_a_file_that_cannot_be_is_told_without_a_traceback(tmp_path: Path) -> None:
    found = checked(tmp_path / f"{'x' * 300}.xml")
    assert (found.exit_code, "cannot read" in found.stderr) == (2, True), found.stderr


@pytest.mark.parametrize("what", ["much text", "many nodes", "a script without end", "a leaf that raises"])
def test_whatever_is_checked_there_is_an_answer(file: Path, what: str) -> None:
    leaf, told = ODD[what]
    file.write_text(tree(leaf))
    found = checked(file, "--nodes", "tests.executor.test_checking:Unmakeable")
    assert found.exit_code == 2
    assert told in found.stderr


def nested(levels: int, leaf: str) -> str:
    """Return a leaf within so many decorators."""
    return "<ForceSuccess>" * levels + leaf + "</ForceSuccess>" * levels


def test_two_hundred_levels_run_and_more_than_the_limit_are_refused() -> None:
    with Rig() as rig:
        rig.add(Executor)
        command(rig, Command.LOAD, tree(nested(200, '<Sleep msec="100000"/>')))
        assert len(command(rig, Command.STEP).running) == 1
        assert command(rig, Command.SWAP, tree(nested(200, '<Sleep name="new" msec="1"/>'))).nodes[-1].name == "new"
        assert "nested" in refusal(rig, Command.SWAP, tree(nested(300, "<AlwaysSuccess/>")))
        assert status(rig).state is MissionState.PAUSED


@pytest.mark.parametrize("what", ODD)
def test_whatever_is_loaded_the_mission_under_way_goes_on(what: str) -> None:
    leaf, told = ODD[what]
    with Rig() as rig:
        run(rig, tree('<Sleep msec="1000000"/>'), nodes="tests.executor.test_checking:Unmakeable")
        rig.advance(0.5)
        before = status(rig)
        assert told in refusal(rig, Command.SWAP, tree(leaf))
        assert told in refusal(rig, Command.LOAD, tree(leaf))
        assert status(rig) == before
        assert [event for event in rig.events if event.kind == "component.fault"] == []


def test_a_text_that_grows_without_end_does_not_keep_the_mission_from_being_told_of() -> None:
    with Rig() as rig:
        doubling = '<Repeat num_cycles="15"><Script code="a += a"/></Repeat>'
        run(rig, tree("<Script code=\"a := 'xx'\"/>", doubling, '<NavigateTo x="{a}" y="0"/>'))
        rig.advance(3.0)
        failed = status(rig)
        assert failed.state is MissionState.FAILED
        assert "is not a number" in failed.error or "xxx" in failed.error
        assert len(failed.error) <= 2000
        assert [event for event in rig.events if event.kind == "component.fault"] == []


def test_a_text_that_doubles_without_end_fails_its_script_and_nothing_else() -> None:
    with Rig() as rig:
        doubling = '<Repeat num_cycles="-1"><Script name="grow" code="a := a + a"/></Repeat>'
        run(rig, tree("<Script code=\"a := 'xx'\"/>", doubling))
        rig.advance(3.0)
        failed = status(rig)
        assert failed.state is MissionState.FAILED
        assert "grow" in failed.error
        assert "at most 100000" in failed.error
        assert [event for event in rig.events if event.kind == "component.fault"] == []


BLANKS = " " * 9_900


@pytest.mark.parametrize(
    "leaf",
    [
        f'<AdaptOnStart subject_location="navigator" rules="max := 1{BLANKS})"><AlwaysSuccess/></AdaptOnStart>',
        f'<AdaptOnStart rules="true : connect a.b{BLANKS}c"><AlwaysSuccess/></AdaptOnStart>',
        f'<AdaptPeriodically rules="a.b := 1" adaptation_period="1{BLANKS}x"><AlwaysSuccess/></AdaptPeriodically>',
        f'<NavigateTo x="{"9" * 9_900}x" y="0"/>',
    ],
)
def test_long_texts_are_refused_in_one_pass(leaf: str) -> None:
    with Rig() as rig:
        run(rig, tree('<Sleep msec="1000000"/>'))
        assert "<text>:2" in refusal(rig, Command.CHECK, tree(leaf * 10))
        assert status(rig).state is MissionState.RUNNING


def test_trees_that_grow_too_large_by_their_sub_trees_are_refused() -> None:
    doubling = "".join(
        f'<BehaviorTree ID="T{n}"><Sequence><SubTree ID="T{n + 1}"/><SubTree ID="T{n + 1}"/></Sequence></BehaviorTree>'
        for n in range(40)
    )
    last = '<BehaviorTree ID="T40"><AlwaysSuccess/></BehaviorTree>'
    fat = f'<BehaviorTree ID="Fat"><Say text="{LARGE[:9_000]}"/></BehaviorTree>'
    with Rig() as rig:
        rig.add(Executor)
        start = '<root BTCPP_format="4" main_tree_to_execute='
        assert "nodes" in refusal(rig, Command.LOAD, f'{start}"T0">{doubling}{last}</root>')
        uses = '<SubTree ID="Fat"/>' * 1000
        main = f'<BehaviorTree ID="Main"><Sequence>{uses}</Sequence></BehaviorTree>'
        assert "characters" in refusal(rig, Command.LOAD, f'{start}"Main">{main}{fat}</root>')
        assert status(rig).state is MissionState.EMPTY
