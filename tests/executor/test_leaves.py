"""What each leaf promises."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    Command,
    MissionState,
    MissionStatus,
    WriteBlackboard,
)
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import command, refusal, run, status, tree
from tests.executor.robot import Detector, Navigator, Porter, goals

CALL = (
    '<CallService service="detect" request_type="regraft/Detect" reply_type="regraft/Sightings" '
    "request='json:{}' {}/>"
)
ACT = (
    '<CallAction action="navigate_to" goal_type="regraft/NavigateTo" result_type="regraft/Arrival" '
    "feedback_type=\"regraft/NavigationProgress\" goal='json:{}' {}/>"
)
POSE = '{"goal": {"frame": "map", "pose": {"position": {"x": 5.0, "y": "{far}", "z": 0.0}, "orientation": %s}}}'
UPRIGHT = '{"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}'


def finish(rig: Rig, nodes: Sequence[str], seconds: float = 5.0) -> MissionStatus:
    """Run a sequence of nodes to its end."""
    run(rig, tree(*nodes))
    rig.advance(seconds)
    return status(rig)


def test_detect_writes_what_was_seen() -> None:
    with Rig() as rig:
        detector = rig.add(Detector)
        outputs = " ".join(f'{port}="{{{port}}}"' for port in ("looked", "hits", "found", "x", "y", "confidence"))
        seen = finish(rig, [f'<Detect label="ball" pictures="3" {outputs}/>']).blackboard
        assert {key: seen[key] for key in ("looked", "hits", "found", "x", "y", "confidence")} == {
            "looked": 3, "hits": 3, "found": True, "x": 1.0, "y": 2.0, "confidence": 0.9,
        }  # fmt: skip
        assert (detector.asked[0].label, detector.asked[0].pictures) == ("ball", 3)


def test_detect_writes_which_pictures_took_energy_as_far_as_that_is_reported() -> None:
    leaf = '<Detect label="ball" pictures="3" paid="{paid}" picture_energy="{energy}"/>'
    with Rig() as rig:
        rig.add(Detector)
        seen = finish(rig, [leaf]).blackboard
        assert (seen["paid"], seen["energy"]) == (3, None)
    with Rig() as rig:
        rig.add(Detector, parameters={"paid": 2, "picture_energy": 10.0})
        seen = finish(rig, [leaf]).blackboard
        assert (seen["paid"], seen["energy"]) == (2, 10.0)


def test_a_drive_tells_how_far_it_is() -> None:
    with Rig() as rig:
        rig.add(Navigator)
        run(rig, tree('<NavigateTo x="1" y="2" distance_left="{left}"/>'))
        rig.advance(1.0)
        assert status(rig).blackboard["left"] == 1.5
        rig.advance(2.0)
        assert status(rig).blackboard["left"] == 0.0


def test_a_drive_that_does_not_arrive_says_why() -> None:
    with Rig() as rig:
        rig.add(Navigator, parameters={"failures": 1})
        failed = finish(rig, ['<NavigateTo name="drive" x="1" y="2" reason="{why}"/>'])
        assert failed.state is MissionState.FAILED
        assert failed.blackboard["why"] == "the way is blocked"
        assert failed.error == "the tree failed, last at 'drive'"


def test_a_tree_learns_the_code_of_a_refusal_and_goals_side_by_side_are_pursued_up_to_their_number() -> None:
    with Rig() as rig:
        porter = rig.add(Porter)
        leaf = (
            '<CallAction name="{0}" action="carry" goal_type="regraft/Detect" result_type="regraft/Sightings" '
            """goal='json:{{"label": "{0}"}}' code="{{code_{0}}}" reason="{{why_{0}}}"/>"""
        )
        leaves = "".join(f"<ForceSuccess>{leaf.format(name)}</ForceSuccess>" for name in ("a", "b", "c"))
        done = finish(rig, [f'<Parallel success_count="3">{leaves}</Parallel>'])
        assert done.state is MissionState.SUCCEEDED
        assert porter.carried == ["a", "b"]
        assert {key: done.blackboard.get(key, "") for key in ("code_a", "code_b", "code_c")} == {
            "code_a": "",
            "code_b": "",
            "code_c": "busy",
        }
        assert "carry pursues 2 goals already" in done.blackboard["why_c"]


def test_a_service_that_nobody_offers_is_a_failure_with_a_reason() -> None:
    with Rig() as rig:
        failed = finish(rig, ['<Detect timeout="1.0" reason="{why}"/>'])
        assert failed.state is MissionState.FAILED
        assert "nobody offers this service" in failed.blackboard["why"]


def test_any_service_can_be_called_with_json() -> None:
    with Rig() as rig:
        detector = rig.add(Detector)
        call = CALL.format('{"label": "{what}", "pictures": 2}', 'field="best.position.y" value="{y}" reply="{all}"')
        done = finish(rig, ['<SetBlackboard value="lamp" output_key="what"/>', call])
        assert done.state is MissionState.SUCCEEDED, done.error
        assert (detector.asked[0].label, detector.asked[0].pictures) == ("lamp", 2)
        assert done.blackboard["y"] == 2.0
        assert done.blackboard["all"]["hits"] == 2


def test_any_action_can_be_given_a_goal_with_json() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        act = ACT.format(POSE % UPRIGHT, 'field="arrived" value="{there}" feedback="{progress}"')
        done = finish(rig, ['<Script code="far := 2.5"/>', act, '<ScriptCondition code="there"/>'])
        assert done.state is MissionState.SUCCEEDED, done.error
        assert navigator.reached == [5.0]
        assert done.blackboard["progress"]["phase"] == "driving"


def test_a_generic_action_is_cancelled_when_it_is_halted() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        run(rig, tree('<Script code="far := 2.5"/>', ACT.format(POSE % UPRIGHT, "")))
        rig.advance(1.0)
        command(rig, Command.HALT)
        assert navigator.cancelled == [5.0]


@pytest.mark.parametrize(
    ("node", "complaint"),
    [
        ("<NavigateTo/>", "either the port goal, or the ports x and y"),
        ('<NavigateTo x="1" y="2" goal="{goal}"/>', "either the port goal, or the ports x and y"),
        ('<NavigateTo x="1" y="two"/>', "'two' is not a number"),
        ('<WaitForTopic input="gaols"/>', "no input 'gaols'; it has: goals, battery, light"),
        ("<WaitForTopic/>", "needs the port input"),
        ('<CallService service="detect"/>', "needs the ports request_type, reply_type"),
        (
            CALL.replace("regraft/Sightings", "regraft/Nothing").format("{}", ""),
            "'regraft/Nothing' is no message",
        ),
        (CALL.format("{,}", ""), "is not JSON"),
        (CALL.replace("json:", "").format('{"label": "a"}', ""), "write json: before"),
        ("<NextGoal/>", "needs the ports goals, index, goal"),
        ("<Say/>", "needs the port text"),
        ('<Say text="a" details="n @node"/>', "port 'details' names 'node'"),
        ('<NavigateTo x="inf" y="2"/>', "port 'x' must be from -1e+09 to 1e+09, is inf"),
        ('<NavigateTo x="1" y="2" accept_within="1e300"/>', "port 'accept_within' must be from 0 to 1e+09, is 1e+300"),
        (CALL.format("{}", 'timeout="-1"'), "port 'timeout' must be from 0 to 1e+09, is -1"),
        ('<Spin spin_dist="1" server_timeout="inf"/>', "port 'server_timeout' must be from 0 to 1e+09, is inf"),
    ],
)
def test_a_leaf_that_cannot_work_is_refused_with_its_line(node: str, complaint: str) -> None:
    with Rig() as rig:
        rig.add(Executor)
        why = refusal(rig, Command.LOAD, tree("<AlwaysSuccess/>", node))
        assert ":3:" in why
        assert complaint in why


def test_a_request_that_does_not_fit_its_type_fails_the_mission_with_the_field() -> None:
    with Rig() as rig:
        failed = finish(rig, [CALL.format('{"pictures": "many"}', 'name="culprit"')])
        assert failed.state is MissionState.FAILED
        assert "culprit" in failed.error
        assert "pictures" in failed.error


def test_an_unknown_field_of_a_reply_fails_the_mission_naming_those_there_are() -> None:
    with Rig() as rig:
        rig.add(Detector)
        failed = finish(rig, [CALL.format("{}", 'field="hit" value="{n}"')])
        assert "no field 'hit'" in failed.error
        assert "pictures, hits, best" in failed.error


def test_say_tells_the_values_of_entries() -> None:
    with Rig() as rig:
        finish(rig, ['<Script code="n := 3"/>', '<Say event="mission.note" text="n is {n}, m is {m}"/>'])
        assert [event.text for event in rig.events if event.kind == "mission.note"] == ["n is 3, m is ?"]


def test_say_tells_values_that_are_no_plain_data_as_text() -> None:
    with Rig() as rig:
        nodes = ["<Script code=\"x := 0.0 / 0.0; keys := 'x text'\"/>", '<Say text="a" details="{keys}"/>']
        assert finish(rig, nodes).state is MissionState.SUCCEEDED
        (said,) = [event for event in rig.events if event.kind == "mission.said"]
        assert (said.text, said.details["x"]) == ("a", "nan")


def test_a_goal_whose_time_is_no_time_is_not_given() -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        node = '<NavigateTo x="1" y="2" accept_within="{long}"/>'
        assert finish(rig, ['<Script code="long := 1e300"/>', node]).state is MissionState.FAILED
        assert navigator.asked == []


def test_waiting_for_a_condition_waits_for_the_entries_that_it_needs() -> None:
    with Rig() as rig:
        run(rig, tree('<WaitForCondition name="wait" code="@battery_charge > 0.9 &amp;&amp; here == 1"/>'))
        rig.advance(1.0)
        assert status(rig).running == ("wait",)
        rig.publish("battery", BatteryState(0.0, 1900.0, 2000.0, 0.95, 10.0))
        rig.advance(1.0)
        assert status(rig).running == ("wait",)
        rig.call("mission/write", WriteBlackboard({"here": 1}), BlackboardEntries)
        rig.advance(1.0)
        assert status(rig).state is MissionState.SUCCEEDED


def test_waiting_for_a_condition_waits_for_no_entry_that_decides_nothing() -> None:
    with Rig() as rig:
        nodes = ['<Script code="done := true"/>', '<WaitForCondition code="done ? true : progress > 1"/>']
        assert finish(rig, nodes, 1.0).state is MissionState.SUCCEEDED


def test_waiting_for_a_topic_ends_with_its_message() -> None:
    with Rig() as rig:
        run(rig, tree('<WaitForTopic name="wait" input="goals"/>'))
        rig.advance(1.0)
        assert status(rig).running == ("wait",)
        rig.publish("goals", goals("north"))
        rig.advance(0.2)
        assert status(rig).state is MissionState.SUCCEEDED


def test_waiting_for_a_fresh_message_ignores_the_one_that_is_there() -> None:
    with Rig() as rig:
        rig.add(Executor)
        rig.publish("goals", goals("north"))
        command(rig, Command.LOAD, tree('<WaitForTopic name="wait" input="goals" fresh="true"/>'))
        command(rig, Command.START)
        rig.advance(1.0)
        assert status(rig).running == ("wait",)
        rig.publish("goals", goals("east"))
        rig.advance(0.2)
        assert status(rig).state is MissionState.SUCCEEDED


def test_goals_come_one_after_the_other_and_then_the_first_again() -> None:
    with Rig() as rig:
        following = '<NextGoal goals="{all}" index="{i}" goal="{goal}" goal_name="{name}"/>'
        run(rig, tree('<GetGoals goals="{all}" count="{n}"/>', *([following, '<Say text="{name}"/>'] * 3)))
        rig.publish("goals", goals("north", "east"))
        rig.advance(1.0)
        assert [event.text for event in rig.events if event.kind == "mission.said"] == [
            "north",
            "east",
            "north",
        ]
        assert status(rig).blackboard["n"] == 2


@pytest.mark.parametrize(
    ("port", "entries"),
    [
        ("{goal}", {"goal": [3.0, 4.0]}),
        ("{goal}", {"goal": [3, 4, 0.5]}),
        ("{goal}", {"goal": "3;4"}),
        ("3;4;0.5", {"other": 1}),
    ],
)
def test_a_goal_of_a_drive_may_be_numbers(port: str, entries: dict[str, PlainValue]) -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        rig.add(Executor, parameters={"autostart": False})
        command(rig, Command.LOAD, tree(f'<NavigateTo goal="{port}"/>'))
        rig.call("mission/write", WriteBlackboard(entries), BlackboardEntries)
        command(rig, Command.START)
        rig.advance(5.0)
        assert (status(rig).state, navigator.reached) == (MissionState.SUCCEEDED, [3.0])


@pytest.mark.parametrize(
    "leaf",
    [
        '<TakeGoal goals="{all}" goal="{goal}"/>',
        '<NextGoal goals="{all}" index="{i}" goal="{goal}"/>',
    ],
    ids=["TakeGoal", "NextGoal"],
)
def test_the_next_goal_may_be_of_another_form_than_the_one_before(leaf: str) -> None:
    with Rig() as rig:
        navigator = rig.add(Navigator)
        run(rig, tree('<GetGoals goals="{all}"/>', leaf, '<NavigateTo goal="{goal}"/>'))
        rig.call("mission/write", WriteBlackboard({"goal": [9.0, 9.0]}), BlackboardEntries)
        rig.publish("goals", goals("north"))
        rig.advance(5.0)
        assert (status(rig).state, navigator.reached) == (MissionState.SUCCEEDED, [0.0])


def test_charge_and_darkness_are_on_the_root_blackboard() -> None:
    with Rig() as rig:
        run(
            rig,
            tree('<WaitForTopic input="light"/>', '<Script code="d := @darkness"/>', '<Sleep msec="9000"/>'),
        )
        rig.publish("light", LightLevel(0.0, 0.25))
        rig.publish("battery", BatteryState(0.0, 1000.0, 2000.0, 0.5, 10.0))
        rig.advance(0.5)
        board = status(rig).blackboard
        assert (board["d"], board["darkness"], board["battery_charge"]) == (0.25, 0.25, 0.5)


def test_a_value_from_a_topic_counts_as_updated_once_for_each_message() -> None:
    with Rig() as rig:
        count = '<SkipUnlessUpdated entry="{@darkness}"><Script code="n += 1"/></SkipUnlessUpdated>'
        loop = f"<KeepRunningUntilFailure><ForceSuccess>{count}</ForceSuccess></KeepRunningUntilFailure>"
        run(rig, tree('<Script code="n := 0"/>', loop))
        for darkness in (0.1, 0.1, 0.2):
            rig.publish("light", LightLevel(0.0, darkness))
            rig.advance(1.0)
        assert status(rig).blackboard["n"] == 3
