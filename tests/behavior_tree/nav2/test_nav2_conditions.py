"""Nav2's conditions, on a clock and a blackboard that the test moves."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behavior_tree import LoadError, ManualClock, NodeError, Registry, Tree, load_text
from behavior_tree.nav2.leaves import NAV2_CONDITIONS, register_nav2_conditions
from tests.behavior_tree.trees import document

PATH = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)]


class Asked:
    """A condition that keeps its status between ticks, as below a ReactiveSequence, until it is reset."""

    def __init__(self, condition: str, **entries: Any) -> None:
        registry = Registry()
        register_nav2_conditions(registry)
        self.clock = ManualClock()
        self.tree: Tree = load_text(document(condition), registry, clock=self.clock)
        self.node = self.tree.nodes[0]
        self.board = self.tree.blackboard
        self.write(**entries)

    def write(self, **entries: Any) -> None:
        for key, value in entries.items():
            self.board.set(key, value)

    def __call__(self, **entries: Any) -> bool:
        """Write entries and ask."""
        self.write(**entries)
        return self.node.execute_tick() == 2

    def reset(self) -> None:
        self.node.reset()


def test_the_names_that_are_taken_are_left_out() -> None:
    registry = Registry()
    assert register_nav2_conditions(registry) == ()
    assert len(register_nav2_conditions(registry)) == len(NAV2_CONDITIONS)


def test_goal_updated_holds_once_after_a_change_and_not_at_the_start() -> None:
    asked = Asked("<GoalUpdated/>", goal=[1.0, 2.0])
    assert [asked(), asked(), asked(goal=[2.0, 2.0]), asked()] == [False, False, True, False]
    asked.reset()
    assert [asked(goal=[3.0, 2.0]), asked(), asked(goals=[[1.0, 1.0]])] == [False, False, True]


def test_a_globally_updated_goal_holds_at_first_and_for_changes_while_it_was_reset() -> None:
    asked = Asked("<GlobalUpdatedGoal/>", goal=[1.0, 2.0])
    assert [asked(), asked()] == [True, False]
    asked.reset()
    assert [asked(), asked(goal=[3.0, 2.0]), asked()] == [False, True, False]


def test_a_goal_is_reached_within_its_tolerance() -> None:
    asked = Asked('<GoalReached goal="{goal}"/>', goal=[1.0, 0.0])
    assert not asked(), "where the robot is is not known"
    assert [asked(robot_pose=[0.7, 0.0]), asked(robot_pose=[0.8, 0.0]), asked(robot_pose=[1.0, 0.25])] == [
        False, True, True,
    ]  # fmt: skip
    assert Asked('<GoalReached goal="1;0" goal_reached_tol="2"/>')(robot_pose=[0.0, 0.0])


def test_the_initial_pose_is_received_when_the_entry_is_true() -> None:
    asked = Asked("<InitialPoseReceived/>")
    assert [asked(), asked(initial_pose_received=False), asked(initial_pose_received=True)] == [False, False, True]


def test_a_time_expires_again_and_again_and_begins_at_a_start() -> None:
    asked = Asked('<TimeExpired seconds="1.0"/>')
    found = []
    for _ in range(6):
        found.append(asked())
        asked.clock.advance(0.5)
    assert found == [False, False, True, False, True, False]
    asked.clock.advance(5.0)
    asked.reset()
    assert not asked()


def test_a_path_expires_after_its_time_which_another_path_starts_afresh() -> None:
    asked = Asked('<PathExpiringTimer seconds="1.0" path="{path}"/>', path=[1])
    found = [asked()]
    for path in ([1], [1], [2], [2], [2]):
        asked.clock.advance(0.5)
        found.append(asked(path=path))
    assert found == [False, False, True, False, False, True]
    asked.reset()
    asked.clock.advance(1.0)
    assert asked(), "a reset does not start it afresh"


def test_a_distance_is_travelled_from_the_start_and_from_where_it_held_last() -> None:
    asked = Asked('<DistanceTraveled distance="1.0"/>')
    assert not asked()
    steps = [asked(robot_pose=[x, 0.0]) for x in (0.0, 0.5, 1.0, 1.5, 2.0)]
    assert steps == [False, False, True, False, True]


@pytest.mark.parametrize(
    ("condition", "codes"),
    [
        ("WouldAControllerRecoveryHelp", {100, 104, 105, 106}),
        ("WouldAPlannerRecoveryHelp", {200, 207, 208, 300, 307, 308}),
        ("WouldARouteRecoveryHelp", {400, 404, 405}),
        ("WouldASmootherRecoveryHelp", {500, 502, 503, 504}),
    ],
)
def test_a_recovery_helps_for_nav2s_codes(condition: str, codes: set[int]) -> None:
    asked = Asked(f'<{condition} error_code="{{code}}"/>')
    assert not asked(), "an unset code is no error"
    assert {code for code in range(600) if asked(code=code)} == codes


def test_codes_to_check_may_be_given() -> None:
    asked = Asked('<AreErrorCodesPresent error_code="{code}" error_codes_to_check="101;107"/>', code=107)
    assert [asked(), asked(code=102)] == [True, False]
    listed = Asked('<AreErrorCodesPresent error_code="{code}" error_codes_to_check="{codes}"/>', code=7, codes=[7, 9])
    assert listed()
    with pytest.raises(LoadError, match="it needs whole numbers, as 101;107"):
        Asked('<AreErrorCodesPresent error_code="1" error_codes_to_check="some"/>')


def test_poses_are_near_within_a_tolerance() -> None:
    assert Asked('<ArePosesNear ref_pose="0;0" target_pose="0.3;0.4"/>')()
    assert not Asked('<ArePosesNear ref_pose="0;0" target_pose="0.3;0.4" tolerance="0.4"/>')()
    with pytest.raises(NodeError, match="is no pose"):
        Asked('<ArePosesNear ref_pose="here" target_pose="0;0"/>')()


def test_a_goal_is_nearby_when_the_rest_of_the_path_is_short() -> None:
    asked = Asked('<IsGoalNearby path="{path}" proximity_threshold="1.5"/>')
    assert not asked(robot_pose=[0.0, 0.0]), "there is no path"
    assert [asked(path=PATH, robot_pose=[x, 0.2]) for x in (0.0, 1.0, 2.0, 3.0)] == [False, False, True, True]


def test_a_bounded_search_does_not_jump_to_a_later_part_of_the_path() -> None:
    loop = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 0.1), (1.0, 0.1), (0.0, 0.1)]
    free = Asked('<IsGoalNearby path="{path}" proximity_threshold="0.5"/>', path=loop)
    bound = Asked('<IsGoalNearby path="{path}" proximity_threshold="0.5" max_robot_pose_search_dist="1.2"/>', path=loop)
    assert free(robot_pose=[0.0, 0.08])
    assert not bound(robot_pose=[0.0, 0.08])
    for place in ([1.0, 0.0], [2.0, 0.0], [2.0, 0.1], [1.0, 0.1]):
        assert not bound(robot_pose=place)
    assert bound(robot_pose=[0.0, 0.1])


@given(aside=st.floats(-2.0, 2.0), turned=st.floats(-3.0, 3.0))
def test_bounds_differ_by_side_and_hold_while_nothing_is_known(aside: float, turned: float) -> None:
    asked = Asked(
        '<IsWithinPathTrackingBounds max_error_left="0.5" max_error_right="-1.0" max_error_heading="2.0"'
        ' tracking_feedback="{feedback}"/>'
    )
    assert asked()
    holds = asked(feedback={"position_tracking_error": aside, "heading_tracking_error": turned})
    assert holds is (-1.0 <= aside <= 0.5 and abs(turned) <= 2.0)


def test_what_is_no_feedback_is_an_error() -> None:
    with pytest.raises(NodeError, match="needs position_tracking_error"):
        Asked('<IsWithinPathTrackingBounds tracking_feedback="{feedback}"/>')(feedback=[1.0])
