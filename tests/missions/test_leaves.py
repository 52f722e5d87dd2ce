"""What the leaves that FROG's missions need promise."""

from __future__ import annotations

from regraft.bus_schema.messages.mission import Command, MissionCommand, MissionRequest, MissionState, MissionStatus
from regraft.bus_schema.model.adaptation import ChangeState, Connect, EnterMode, Remove, SetParameters, Swap
from regraft.bus_schema.model.lifecycle import Transition
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import command, refusal, run, status, tree
from tests.executor.robot import goals
from tests.missions.robot import Docking, Explorer, Manager, Mapper, sensors

ACTIVATE = '[{"change": "transition", "component": "detector", "transition": "activate"}]'


def test_the_next_frontier_is_written_and_what_was_not_reached_is_told() -> None:
    with Rig() as rig:
        explorer = rig.add(Explorer, parameters={"count": 1})
        run(
            rig,
            tree(
                '<NextFrontier left="{left}" goal="{goal}" found="{found}" distance="{far}"/>',
                '<NextFrontier unreached="true" found="{more}"/>',
            ),
        )
        rig.advance(1.0)
        seen = status(rig)
        assert seen.state is MissionState.SUCCEEDED, seen.error
        assert explorer.asked == [False, True]
        board = seen.blackboard
        assert (board["left"], board["found"], board["far"], board["more"]) == (1, True, 2.0, False)
        assert board["goal"]["pose"]["position"]["x"] == 1.0


def test_charging_tells_how_it_goes_and_fails_with_a_reason() -> None:
    with Rig() as rig:
        docking = rig.add(Docking)
        docking.failures = 1
        run(rig, tree('<Charge until="0.8" phase="{phase}" time_left="{left}" reason="{why}"/>'))
        rig.advance(3.0)
        assert (status(rig).blackboard["phase"], status(rig).blackboard["left"]) == ("driving", 10.0)
        rig.advance(8.0)
        assert status(rig).state is MissionState.FAILED
        assert status(rig).blackboard["why"] == "no charger felt"
        assert docking.until == [0.8]


def test_charging_that_is_halted_is_cancelled() -> None:
    with Rig() as rig:
        docking = rig.add(Docking)
        run(rig, tree('<Timeout msec="3000"><Charge/></Timeout>'))
        rig.advance(5.0)
        assert docking.cancelled == 1


def test_a_mission_of_one_robot_among_several_asks_its_own_robot_and_changes_it() -> None:
    changes = (
        '[{"change": "connect", "component": "detector", "port": "image", "topic": "/corner_camera/image"},'
        ' {"change": "mode", "mode": "slow"},'
        ' {"change": "swap", "component": "/world", "connect": {"scan": "scan"}},'
        ' {"change": "remove", "component": "lamp", "topics": ["light"]}]'
    )
    with Rig() as rig:
        manager = rig.add(Manager)
        own, other = (rig.add(Explorer, f"{robot}.explorer", scope=robot) for robot in ("left", "right"))
        rig.add(Executor, "left.bt_executor", {"autostart": False}, scope="left")
        asking = tree("<NextFrontier/>", f"<Adapt changes='json:{changes}'/>")
        for what, xml in ((Command.LOAD, asking), (Command.START, "")):
            rig.call("left/mission/command", MissionCommand(what, xml), MissionStatus)
        rig.advance(5.0)
        seen = rig.call("left/mission/status", MissionRequest(), MissionStatus)
    assert seen.state is MissionState.SUCCEEDED, seen.error
    assert (len(own.asked), len(other.asked)) == (1, 0)
    assert manager.asked[0].changes == (
        Connect("left.detector", "image", "corner_camera/image"),
        EnterMode("left/slow"),
        Swap("world", connections={"scan": "left/scan"}),
        Remove("left.lamp", ("left/light",)),
    )


def test_an_adaptation_is_asked_for_and_waited_for() -> None:
    with Rig() as rig:
        manager = rig.add(Manager)
        changes = (
            '[{"change": "transition", "component": "detector", "transition": "activate"},'
            ' {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": "{speed}"}}]'
        )
        adapt = f'<Adapt name="adapt" because="explored" changes=\'json:{changes}\' revision="{{revision}}"/>'
        run(rig, tree('<Script code="speed := 0.2"/>', adapt))
        assert status(rig).running == ("adapt",)
        rig.advance(1.0)
        assert status(rig).state is MissionState.SUCCEEDED
        assert status(rig).blackboard["revision"] == 2
        (asked,) = manager.asked
        assert asked.changes == (
            ChangeState("detector", Transition.ACTIVATE),
            SetParameters("navigator", {"max_velocity": 0.2}),
        )
        assert (asked.reason, asked.actor) == ("explored", "adapt")


def test_a_rejected_adaptation_is_a_failure_that_says_why() -> None:
    with Rig() as rig:
        rig.add(Manager).refuse = "there is no such component"
        run(rig, tree(f'<Adapt changes=\'json:{ACTIVATE}\' outcome="{{outcome}}" reason="{{why}}"/>'))
        rig.advance(1.0)
        board = status(rig).blackboard
        assert status(rig).state is MissionState.FAILED
        assert board["outcome"] == "rejected"
        assert board["why"] == "the adaptation was rejected: detector.component: there is no such component"


def test_a_manager_that_does_not_answer_is_waited_for_within_bounds() -> None:
    with Rig() as rig:
        run(rig, tree(f"<Adapt changes='json:{ACTIVATE}' timeout=\"2\"/>"))
        rig.advance(3.0)
        assert status(rig).state is MissionState.FAILED


def test_changes_that_are_none_are_refused_when_the_tree_is_loaded() -> None:
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"autostart": False})
        wrong = '[{"change": "transition", "component": "detector", "transition": "fly"}]'
        assert "transition" in refusal(rig, Command.LOAD, tree(f"<Adapt changes='json:{wrong}'/>"))
        assert "is not JSON" in refusal(rig, Command.LOAD, tree('<Adapt changes="activate it"/>'))
        assert "needs the port changes" in refusal(rig, Command.LOAD, tree("<Adapt/>"))


def test_a_map_is_kept() -> None:
    with Rig() as rig:
        rig.add(Mapper)
        run(rig, tree('<SaveMap file="room" saved_as="{file}" known_area="{area}"/>'))
        rig.advance(1.0)
        assert status(rig).blackboard["file"] == "/maps/room.yaml"
        assert status(rig).blackboard["area"] == 20.0


def test_goals_are_taken_from_a_list_and_put_at_the_end_of_another() -> None:
    with Rig() as rig:
        take = '<TakeGoal goals="{goals}" goal="{goal}" goal_name="{name}"/>'
        put = '<PutGoal goals="{later}" goal="{goal}"/>'
        rig.add(Executor, "bt_executor", {"autostart": False})
        rig.publish("goals", goals("north", "east"))
        run_tree = tree('<GetGoals goals="{goals}"/>', take, put, take, put, f"<Inverter>{take}</Inverter>")
        command(rig, Command.LOAD, run_tree)
        command(rig, Command.START)
        rig.advance(1.0)
        seen = status(rig)
        assert seen.state is MissionState.SUCCEEDED, seen.error
        assert [goal["name"] for goal in seen.blackboard["later"]] == ["north", "east"]
        assert seen.blackboard["goals"] == []


def test_an_event_carries_the_values_of_entries() -> None:
    with Rig() as rig:
        run(rig, tree('<Script code="x := 1.25; @y := 2"/>', '<Say event="a.b" text="at {x}" details="x @y none"/>'))
        (told,) = [event for event in rig.events if event.kind == "a.b"]
        assert told.text == "at 1.25"
        assert {key: told.details[key] for key in ("x", "y", "none")} == {"x": 1.25, "y": 2, "none": None}


def test_what_is_wrong_with_the_sensors_is_on_the_blackboard() -> None:
    with Rig() as rig:
        run(rig, tree('<Sleep msec="5000"/>'))
        sensors(rig, "scan silent", "odometry frozen")
        rig.advance(1.0)
        assert status(rig).blackboard["sensor_faults"] == "scan silent; odometry frozen"
        sensors(rig)
        rig.advance(1.0)
        assert status(rig).blackboard["sensor_faults"] == ""
