"""Where the robot was at a time."""

import math

from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.messages.geometry import Pose, Twist, Vector3
from regraft.bus_schema.messages.sensors import Odometry
from regraft.services.detector.pose_history import MAX_AHEAD, MAX_GAP, PoseHistory


def odometry(stamp: float, x: float = 0.0, yaw: float = 0.0, speed: float = 0.0, turn: float = 0.0) -> Odometry:
    twist = Twist(Vector3(speed), Vector3(z=turn))
    return Odometry(stamp, "map", "base_link", Pose.planar(x, 0.0, yaw), twist)


def history(*messages: Odometry) -> PoseHistory:
    kept = PoseHistory()
    kept.add(messages)
    return kept


@given(st.floats(0.0, 1.0), st.floats(-3.0, 3.0), st.floats(-1.0, 1.0))
def test_between_two_messages_it_is_on_the_line_the_short_way_round(share: float, yaw: float, turned: float) -> None:
    pose = history(odometry(1.0, 0.0, yaw), odometry(1.2, 0.4, yaw + turned)).at(1.0 + 0.2 * share)
    assert pose is not None
    assert math.isclose(pose.x, 0.4 * share, abs_tol=1e-9)
    assert abs(math.remainder(pose.yaw - yaw - share * turned, math.tau)) < 1e-6


def test_a_little_after_the_last_message_it_goes_on_as_it_went() -> None:
    pose = history(odometry(1.0, speed=0.2, turn=0.5)).at(1.2)
    assert pose is not None
    assert math.isclose(pose.x, 0.04, abs_tol=1e-3)
    assert math.isclose(pose.yaw, 0.1)


def test_what_no_message_is_near_is_not_known() -> None:
    assert history().at(1.0) is None
    assert history(odometry(1.0)).at(0.9) is None
    assert history(odometry(1.0)).at(1.0 + MAX_AHEAD + 0.01) is None
    assert history(odometry(1.0), odometry(1.0 + MAX_GAP + 0.1)).at(1.2) is None


def test_time_that_goes_backwards_begins_a_new_history() -> None:
    kept = history(odometry(10.0, 5.0), odometry(1.0, 1.0))
    assert kept.at(10.0) is None
    pose = kept.at(1.0)
    assert pose is not None
    assert pose.x == 1.0
