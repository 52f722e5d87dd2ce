"""Nav2's decorators, row by row, on a clock and a blackboard that the test moves."""

from dataclasses import dataclass, field
from typing import Any

import pytest

from behavior_tree import LoadError, ManualClock, NodeError, Tree
from behavior_tree.nav2.geometry import length_of, poses_of, position_of, same, stamp_of
from tests.behavior_tree.trees import leaf, statuses, ticks

from .test_nav2_controls import nav2_tree


def around(decorator: str, script: str, ports: str = "", clock: ManualClock | None = None) -> tuple[Tree, list[str]]:
    events: list[str] = []
    return nav2_tree(f"<{decorator} {ports}>{leaf(script, 'n')}</{decorator}>", events, clock), events


def in_pipeline(decorator: str, script: str, ports: str, clock: ManualClock) -> tuple[Tree, list[str]]:
    """Return a decorator that is not reset when it completes, as Nav2's trees have it."""
    events: list[str] = []
    body = f"<{decorator} {ports}>{leaf(script, 'n')}</{decorator}>"
    return nav2_tree(f"<PipelineSequence>{body}<Sleep msec='1000000'/></PipelineSequence>", events, clock), events


def times_of_ticks(tree: Tree, events: list[str], clock: ManualClock, step: float, count: int) -> list[float]:
    """Tick so many times and return the times at which the child was ticked."""
    times = []
    for _ in range(count):
        events.clear()
        tree.tick_exactly_once()
        if events:
            times.append(round(clock.now(), 3))
        clock.advance(step)
    return times


def test_rate_controller_ticks_at_the_start_and_then_once_a_period() -> None:
    clock = ManualClock()
    tree, events = in_pipeline("RateController", "S", 'hz="2.0"', clock)
    assert times_of_ticks(tree, events, clock, 0.125, 12) == [0.0, 0.5, 1.0]


def test_rate_controller_goes_on_with_a_running_child_and_counts_from_its_success() -> None:
    clock = ManualClock()
    tree, events = in_pipeline("RateController", "RRS", 'hz="1.0"', clock)
    assert times_of_ticks(tree, events, clock, 0.25, 9) == [0.0, 0.25, 0.5, 1.5, 1.75, 2.0]


@pytest.mark.parametrize(("script", "result"), [("S", "S"), ("F", "F"), ("K", "K"), ("R", "R")])
def test_rate_controller_passes_the_childs_result_on(script: str, result: str) -> None:
    assert ticks(around("RateController", script)[0], 1) == result


def test_rate_controller_counts_on_from_its_start_while_the_child_is_skipped() -> None:
    clock = ManualClock()
    events: list[str] = []
    tree = nav2_tree(f"<KeepRunningUntilFailure><RateController hz='1'>{leaf('K', 'n')}</RateController>"
                     "</KeepRunningUntilFailure>", events, clock)  # fmt: skip
    assert times_of_ticks(tree, events, clock, 0.5, 5) == [0.0, 1.0, 1.5, 2.0]


def test_rate_controller_tells_when_it_is_due_and_forgets_it_when_halted() -> None:
    clock = ManualClock()
    tree, _ = around("RateController", "RS", 'hz="4"', clock)
    tree.tick_once()
    assert tree.next_wake_up() == 0.25
    tree.halt_tree()
    assert tree.next_wake_up() is None


@pytest.mark.parametrize("decorator", ["RateController hz", "SpeedController min_rate", "SpeedController max_rate"])
def test_rate_of_zero_is_refused(decorator: str) -> None:
    name, port = decorator.split()
    with pytest.raises(LoadError, match="must be greater than 0"):
        around(name, "S", f'{port}="0.0"')
    tree, _ = around(name, "S", f'{port}="{{rate}}"')
    tree.blackboard.set("rate", 0.0)
    with pytest.raises(NodeError, match="must be greater than 0"):
        tree.tick_once()


def test_distance_controller_ticks_again_after_the_robot_moved_so_far() -> None:
    clock = ManualClock()
    tree, events = in_pipeline("DistanceController", "S", 'distance="1.0" global_frame="map"', clock)
    at = []
    for x in (0.0, 0.4, 0.9, 1.0, 1.5, 2.1, 3.0):
        tree.blackboard.set("robot_pose", {"position": {"x": x, "y": 0.0}})
        events.clear()
        tree.tick_exactly_once()
        if events:
            at.append(x)
    assert at == [0.0, 1.0, 2.1]


def test_distance_controller_fails_without_a_pose_and_goes_on_with_a_running_child() -> None:
    tree, events = around("DistanceController", "RRS", 'pose="{here}"')
    assert ticks(tree, 1) == "F"
    tree.blackboard.set("here", [3.0, 4.0])
    assert ticks(tree, 3) == "RRS"
    assert len(events) == 3


def test_speed_controller_ticks_more_often_the_faster_the_robot_is() -> None:
    ports = 'min_rate="0.5" max_rate="2.0" min_speed="0.0" max_speed="1.0"'
    for speed, period in ((0.0, 2.0), (1.0, 0.5), (5.0, 0.5), (1.0 / 3.0, 1.0)):
        clock = ManualClock()
        tree, events = in_pipeline("SpeedController", "S", ports, clock)
        tree.blackboard.set("robot_speed", speed)
        times = times_of_ticks(tree, events, clock, 0.125, 48)
        assert times[:2] == [0.0, 0.5]  # the first period is that of the greatest rate
        assert times[2] - times[1] == pytest.approx(period, abs=0.126)


def test_speed_controller_knows_no_speed_as_standing_and_ticks_at_once_for_a_new_goal() -> None:
    clock = ManualClock()
    tree, events = in_pipeline("SpeedController", "S", 'goal="{where}"', clock)
    times = times_of_ticks(tree, events, clock, 1.0, 3)
    assert times == [0.0, 1.0]
    tree.blackboard.set("where", "elsewhere")
    assert times_of_ticks(tree, events, clock, 1.0, 1) == [3.0]


def test_goal_updated_controller_ticks_at_the_start_and_after_a_change() -> None:
    clock = ManualClock()
    tree, events = in_pipeline("GoalUpdatedController", "S", "", clock)
    tree.blackboard.set("goal", "A")
    assert times_of_ticks(tree, events, clock, 1.0, 3) == [0.0]
    tree.blackboard.set("goal", "B")
    assert times_of_ticks(tree, events, clock, 1.0, 3) == [3.0]
    tree.blackboard.set("goals", ["B", "C"])
    assert times_of_ticks(tree, events, clock, 1.0, 3) == [6.0]


def test_goal_updated_controller_is_running_meanwhile_and_goes_on_with_a_running_child() -> None:
    tree, events = around("GoalUpdatedController", "RRF")
    assert ticks(tree, 3) == "RRF"
    assert len(events) == 3


@dataclass(frozen=True)
class Header:
    stamp: Any


@dataclass(frozen=True)
class Goal:
    place: str
    header: Header


@dataclass(frozen=True)
class Time:
    sec: int
    nanosec: int = 0


def goal(place: str, seconds: float) -> Goal:
    return Goal(place, Header(seconds))


@pytest.mark.parametrize(
    ("given", "received", "newest"),
    [
        (goal("A", 1.0), None, "A"),
        (goal("A", 1.0), goal("B", 2.0), "B"),
        (goal("A", 1.0), goal("B", 1.0), "B"),
        (goal("A", 2.0), goal("B", 1.0), "A"),
        (goal("A", 0.0), goal("B", 0.0), "A"),
        (goal("A", 1.0), Goal("B", Header(Time(1, 5))), "B"),
        (None, goal("B", 1.0), "B"),
    ],
)
def test_goal_updater_passes_the_newest_goal_on(given: Goal | None, received: Goal | None, newest: str) -> None:
    tree, events = around("GoalUpdater", "S", 'input_goal="{goal}" output_goal="{new}"')
    for key, value in (("goal", given), ("goal_update", received)):
        if value is not None:
            tree.blackboard.set(key, value)
    assert ticks(tree, 1) == "S"
    assert tree.blackboard.get("new").place == newest
    assert events == ["n:S"]


def test_goal_updater_passes_goals_on_and_every_result_of_its_child() -> None:
    tree, _ = around("GoalUpdater", "RKF", 'input_goals="{goals}" output_goals="{new}"')
    tree.blackboard.set("goals", [goal("A", 1.0), goal("B", 3.0)])
    tree.blackboard.set("goals_update", [goal("C", 2.0)])
    assert ticks(tree, 1) == "R"
    assert len(tree.blackboard.get("new")) == 2
    tree.blackboard.set("goals_update", [goal("C", 4.0)])
    assert ticks(tree, 2) == "KF"
    assert [item.place for item in tree.blackboard.get("new")] == ["C"]
    tree.blackboard.set("goals_update", [])
    tree.tick_once()
    assert len(tree.blackboard.get("new")) == 2


def straight(length: float, goal_x: float = 0.0, points: int = 3) -> list[tuple[float, float]]:
    """Return a path of a length that ends at a goal."""
    return [(goal_x, length * (points - 1 - index) / (points - 1)) for index in range(points)]


@pytest.mark.parametrize(
    ("old", "new", "asks"),
    [
        (straight(2.0), straight(5.0, points=4), True),
        (straight(2.0), straight(3.9, points=4), False),  # not twice as long
        (straight(3.5), straight(9.0, points=4), False),  # not yet close to the goal
        (straight(2.0), straight(5.0, goal_x=1.0, points=4), False),  # another goal
        (straight(2.0), straight(5.0), False),  # as many poses count as the same path
        ([], straight(5.0), False),
        (straight(2.0), [], False),
    ],
)
def test_path_longer_on_approach_asks_its_child_only_close_to_the_goal(old: Any, new: Any, asks: bool) -> None:
    clock = ManualClock()
    tree, events = in_pipeline("PathLongerOnApproach", "RF", 'path="{path}" prox_len="3.0" length_factor="2.0"', clock)
    assert ticks(tree, 1) == "R"
    for path, expected in ((old, []), (new, ["n:R"] if asks else []), (new, ["n:F"] if asks else [])):
        events.clear()
        tree.blackboard.set("path", {"poses": path})
        tree.tick_exactly_once()
        assert events == expected


def test_path_longer_on_approach_halts_a_child_that_is_no_longer_wanted() -> None:
    tree, events = in_pipeline("PathLongerOnApproach", "R", 'path="{path}"', ManualClock())
    for path in (straight(2.0), straight(5.0, points=4), straight(2.0, points=5)):
        tree.blackboard.set("path", path)
        tree.tick_exactly_once()
    assert events == ["n:R", "n:H"]
    tree.blackboard.set("path", straight(1.0))
    tree.tick_exactly_once()


def test_single_trigger_runs_its_child_once_for_each_start() -> None:
    events: list[str] = []
    trigger = f"<SingleTrigger>{leaf('RS', 'n')}</SingleTrigger>"
    tree = nav2_tree(
        f"<KeepRunningUntilFailure><ForceSuccess>{trigger}</ForceSuccess></KeepRunningUntilFailure>", events
    )
    ticks(tree, 4)
    assert events == ["n:R", "n:S", "n:R", "n:S"]
    tree, events = in_pipeline("SingleTrigger", "KRS", "", ManualClock())
    assert ticks(tree, 4) == "RRRF"
    assert events == ["n:K", "n:R", "n:S"]


def test_single_trigger_may_run_once_for_each_run() -> None:
    tree, events = around("SingleTrigger", "S", 'is_global="true"')
    with pytest.raises(NodeError, match="run_id"):
        tree.tick_once()
    tree.halt_tree()
    tree.blackboard.set("run_id", "first")
    assert ticks(tree, 3) == "SFF"
    tree.blackboard.set("run_id", "second")
    assert ticks(tree, 2) == "SF"
    assert events == ["n:S", "n:S"]


@pytest.mark.parametrize("decorator", ["RateController", "SpeedController", "GoalUpdatedController", "SingleTrigger"])
def test_halted_decorator_halts_its_child_and_starts_anew(decorator: str) -> None:
    tree, events = around(decorator, "R")
    ticks(tree, 1)
    tree.halt_tree()
    assert statuses(tree) == "II"
    ticks(tree, 1)
    assert events == ["n:R", "n:H", "n:R"]


@dataclass
class Plain:
    x: float
    y: float
    poses: list[Any] = field(default_factory=list)


def test_poses_and_paths_of_many_shapes_are_understood() -> None:
    for pose in ((1, 2), [1, 2, 0.5], {"x": 1, "y": 2}, {"pose": {"position": {"x": 1, "y": 2}}}, Plain(1, 2)):
        assert position_of(pose) == (1.0, 2.0)
    for wrong in (None, "here", 5, {}, (1,), {"x": "a", "y": 1}):
        with pytest.raises(ValueError, match="is no pose"):
            position_of(wrong)
    assert length_of(poses_of({"points": [(0, 0), (3, 4), (3, 5)]})) == 6.0
    assert poses_of(None) == ()
    with pytest.raises(ValueError, match="is no path"):
        poses_of("path")
    assert stamp_of({"header": {"stamp": {"sec": 3, "nanosec": 500_000_000}}}) == 3.5
    assert [stamp_of(value) for value in (None, 5, {"stamp": "now"})] == [0.0, 0.0, 0.0]
    assert same([1], [1])
    assert not same([1], None)


def test_nav2_attributes_are_all_accepted() -> None:
    ports = {
        "RateController": 'hz="1"',
        "DistanceController": 'distance="1" global_frame="map" robot_base_frame="base"',
        "SpeedController": 'min_rate="0.1" max_rate="1" min_speed="0" max_speed="0.2" goal="{g}" goals="{gs}"',
        "GoalUpdater": 'input_goal="{a}" input_goals="{b}" output_goal="{c}" output_goals="{d}"',
        "PathLongerOnApproach": 'path="{p}" prox_len="3.0" length_factor="2.0"',
        "GoalUpdatedController": 'goal="{g}" goals="{gs}"',
        "SingleTrigger": "",
    }
    for name, attributes in ports.items():
        assert around(name, "S", attributes)[0].root.type_id == name
