"""What the local controller promises."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.planar import FloatArray, Pose2D, Twist2D
from regraft.services.navigator.driving.local_controller import Manoeuvres, Situation
from regraft.services.navigator.driving.pursuit import PursuitController
from regraft.services.navigator.driving.robot import Footprint, Limits
from regraft.services.navigator.driving.rollout_controller import RolloutController
from regraft.services.navigator.driving.rollouts import candidates, forecast
from regraft.services.navigator.sensing.scan import thin
from regraft.services.navigator.sensing.sight import THINNED

from .world import Box, Robot

CONTROLLER = RolloutController()
MANOEUVRES = Manoeuvres()
NOTHING = np.empty((0, 2))
ORIGIN = Pose2D(0.0, 0.0, 0.0)
AHEAD = np.column_stack([np.linspace(0.0, 2.0, 41), np.zeros(41)])


def wall(x: float, low: float = -1.0, high: float = 1.0) -> FloatArray:
    """Return echoes of a wall across the robot's way."""
    y = np.arange(low, high, 0.03)
    return np.column_stack([np.full(len(y), x), y])


def settle(obstacles: FloatArray, path: FloatArray, limits: Limits, pose: Pose2D = ORIGIN) -> Twist2D:
    """Return the twist that the controller settles on where the robot does not get on."""
    twist = Twist2D()
    for _ in range(20):
        twist = CONTROLLER.follow(Situation(pose, twist, obstacles, limits), path).twist
    return twist


@settings(max_examples=60, deadline=None)
@given(
    max_velocity=st.floats(0.0, 0.26),
    yaw=st.floats(-3.2, 3.2),
    v=st.floats(-0.1, 0.26),
    w=st.floats(-1.0, 1.0),
    distance=st.floats(0.1, 2.0),
)
def test_no_limit_is_ever_exceeded(max_velocity: float, yaw: float, v: float, w: float, distance: float) -> None:
    limits = Limits(max_velocity=max_velocity)
    now = Situation(Pose2D(0.0, 0.0, yaw), Twist2D(v, w), wall(distance), limits)
    for twist in (
        CONTROLLER.follow(now, AHEAD).twist,
        MANOEUVRES.turn(now, 1.0).twist,
        MANOEUVRES.back_up(now, 0.05).twist,
    ):
        assert abs(twist.v) <= max_velocity + 1e-12
        assert abs(twist.w) <= limits.max_turn_rate + 1e-12
        assert abs(twist.v) + abs(twist.w) * limits.track / 2 <= limits.wheel_speed + 1e-12


def test_saturation_keeps_the_curvature() -> None:
    twist = Limits().saturate(Twist2D(0.2, 0.8))
    assert twist.w / twist.v == pytest.approx(4.0)
    assert twist.v + twist.w * 0.287 / 2 == pytest.approx(0.27)


@pytest.mark.parametrize("name", ["max_turn_rate", "acceleration", "wheel_speed", "track"])
def test_limits_that_no_drive_has_are_refused(name: str) -> None:
    with pytest.raises(ValueError, match=name):
        Limits(**{name: 0.0})


def test_straight_path_is_driven_straight_at_full_speed() -> None:
    twist = settle(NOTHING, AHEAD, Limits())
    assert twist.v == pytest.approx(0.26)
    assert twist.w == pytest.approx(0.0, abs=0.01)


FAST = Limits(2.0, 2.0, 2.0, 3.0, 2.5)


@pytest.mark.parametrize("limits", [Limits(), FAST], ids=["usual", "fast"])
def test_pursuit_drives_at_full_speed_until_the_path_s_end_is_near(limits: Limits) -> None:
    robot = Robot(Pose2D(0.0, 0.1, 0.3), [], limits=limits)
    path = np.column_stack([np.linspace(0.0, 12.0, 241), np.zeros(241)])
    for _ in range(1500):
        twist = PursuitController().follow(Situation(robot.pose, robot.twist, NOTHING, limits), path).twist
        robot.drive(twist.v, twist.w)
        if 3.0 < robot.pose.x < 9.0:
            assert robot.twist.v > 0.95 * limits.max_velocity
            assert abs(robot.pose.y) < 0.03
    assert robot.pose.position == pytest.approx((12.0, 0.0), abs=0.08)


def test_pursuit_does_not_creep_before_a_hairpin() -> None:
    robot = Robot(ORIGIN, [], limits=FAST)
    way, bend = np.linspace(0.0, 8.0, 161), np.linspace(-math.pi / 2, math.pi / 2, 30)
    there = np.column_stack([way, np.zeros(161)])
    around = np.column_stack([8.0 + 0.4 * np.cos(bend), 0.4 + 0.4 * np.sin(bend)])
    path = np.concatenate([there, around, np.add(there[::-1], (0.0, 0.8))])
    while robot.pose.x < 7.3:
        twist = PursuitController().follow(Situation(robot.pose, robot.twist, NOTHING, FAST), path).twist
        robot.drive(twist.v, twist.w)
        if robot.pose.x > 3.0:
            assert robot.twist.v > 0.4 * FAST.max_velocity


@given(
    places=st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), max_size=60),
    yaw=st.floats(-0.7, 0.7),
    v=st.floats(0.0, 0.26),
    w=st.floats(-1.0, 1.0),
    max_velocity=st.sampled_from([0.0, 0.05, 0.26]),
)
def test_looking_at_the_most_promising_twists_first_chooses_what_looking_at_all_chooses(
    places: list[tuple[float, float]], yaw: float, v: float, w: float, max_velocity: float
) -> None:
    obstacles = np.array(places, dtype=np.float64).reshape(-1, 2)
    now = Situation(Pose2D(0.0, 0.0, yaw), Twist2D(v, w), obstacles, Limits(max_velocity=max_velocity))
    assert CONTROLLER.follow(now, AHEAD) == RolloutController(portions=()).follow(now, AHEAD)


def test_path_behind_the_robot_is_first_turned_to_in_place() -> None:
    decision = CONTROLLER.follow(Situation(Pose2D(0.0, 0.0, 2.5), Twist2D(), NOTHING, Limits()), AHEAD)
    assert decision.turning
    assert decision.twist.v == 0.0
    assert decision.twist.w < 0.0


def test_turn_goes_the_long_way_round_where_the_short_one_is_not_free() -> None:
    corner = np.array([[-0.20, 0.19]])  # in the way of the rear left corner, for a turn to the right
    free = MANOEUVRES.turn(Situation(ORIGIN, Twist2D(), NOTHING, Limits()), -0.6)
    confined = MANOEUVRES.turn(Situation(ORIGIN, Twist2D(), corner, Limits()), 0.6)
    assert free.twist.w < 0.0
    assert not MANOEUVRES.can_turn(Situation(ORIGIN, Twist2D(), corner, Limits()), -0.6)
    assert confined.twist.w > 0.0


def test_robot_between_two_walls_does_not_turn() -> None:
    sides = np.concatenate([wall(0.0, 0.19, 0.22), -wall(0.15, 0.19, 0.22), wall(-0.15, 0.19, 0.22)])
    sides = np.concatenate([sides, sides * [1.0, -1.0]])
    decision = MANOEUVRES.turn(Situation(ORIGIN, Twist2D(), sides, Limits()), 1.5)
    assert decision.blocked
    assert decision.twist == Twist2D()


def test_obstacle_right_ahead_stops_the_robot() -> None:
    now = Situation(ORIGIN, Twist2D(0.26, 0.0), wall(0.11), Limits())
    decision = CONTROLLER.follow(now, AHEAD)
    assert decision.blocked
    assert decision.twist.v == pytest.approx(0.26 - 2.5 * 0.05)
    assert settle(wall(0.11), AHEAD, Limits()) == Twist2D()


def test_the_nearer_the_wall_ahead_the_slower() -> None:
    speeds = [settle(wall(x), AHEAD, Limits()).v for x in (1.0, 0.4, 0.25, 0.16)]
    assert speeds == sorted(speeds, reverse=True)
    assert speeds[0] == pytest.approx(0.26)
    assert 0.0 < speeds[-1] < 0.1


def test_passage_just_wider_than_the_robot_is_driven_slowly() -> None:
    x = np.arange(-0.5, 2.0, 0.03)
    sides = np.column_stack([np.tile(x, 2), np.repeat([-0.21, 0.21], len(x))])
    twist = settle(sides, AHEAD, Limits())
    assert 0.0 < twist.v < 0.13


def test_post_close_beside_the_path_is_passed_without_touching_it() -> None:
    robot = Robot(ORIGIN, [Box(0.8, 0.22, 0.05, 0.05)])
    for _ in range(300):
        seen = robot.pose.outward(robot.scan().points())
        decision = CONTROLLER.follow(Situation(robot.pose, robot.twist, seen, Limits()), AHEAD)
        robot.drive(decision.twist.v, decision.twist.w)
    assert robot.pose.x > 1.8
    assert robot.collisions == []


LONG = Footprint(1.0, 0.2, 0.3)
CORRIDOR = [Box(1.0, 0.65, 8.0, 0.1), Box(1.0, -0.65, 8.0, 0.1)]
"""Of its walls, more than a hundred echoes are nearer to the axle than the bumper of the long robot."""


@pytest.mark.parametrize("kind", [RolloutController, PursuitController])
@pytest.mark.parametrize("limits", [Limits(), Limits(0.8, 1.0, 0.5, 3.0, 1.0)], ids=["usual", "fast"])
def test_long_robot_in_a_corridor_stops_before_what_is_ahead(
    kind: type[RolloutController] | type[PursuitController], limits: Limits
) -> None:
    controller = kind(Manoeuvres(LONG))
    robot = Robot(ORIGIN, [*CORRIDOR, Box(3.5, 0.0, 0.2, 0.8)], outline=LONG, limits=limits)
    path = np.column_stack([np.linspace(0.0, 5.0, 101), np.zeros(101)])
    for _ in range(400):
        seen = thin(robot.pose.outward(robot.scan().points()), robot.pose, THINNED)
        twist = controller.follow(Situation(robot.pose, robot.twist, seen, limits), path).twist
        robot.drive(twist.v, twist.w)
    assert robot.collisions == []
    assert robot.fastest > 0.9 * limits.max_velocity
    assert robot.pose.x > 1.5
    assert robot.twist.v == 0.0


WEAK = [Limits(1.0, 1.0, 0.3, 3.0, 1.2), Limits(1.5, 1.0, 0.4, 3.0, 1.8), Limits(2.0, 1.0, 0.25, 3.0, 2.5)]
"""Of robots that take longer than three seconds to stop."""


@pytest.mark.parametrize("limits", [FAST, *WEAK])
def test_pursuit_stops_at_the_end_of_the_path_however_weak_the_brakes_are(limits: Limits) -> None:
    robot, path = Robot(ORIGIN, [], limits=limits), np.column_stack([np.linspace(0.0, 16.0, 321), np.zeros(321)])
    for _ in range(1500):
        twist = PursuitController().follow(Situation(robot.pose, robot.twist, NOTHING, limits), path).twist
        robot.drive(twist.v, twist.w)
        assert robot.pose.x < 16.1
    assert robot.pose.position == pytest.approx((16.0, 0.0), abs=0.08)


def test_pursuit_comes_back_to_an_end_that_it_has_passed() -> None:
    robot, path = Robot(Pose2D(13.0, 0.0, 0.0), [], limits=FAST), np.array([[0.0, 0.0], [12.0, 0.0]])
    for _ in range(100):
        twist = PursuitController().follow(Situation(robot.pose, robot.twist, NOTHING, FAST), path).twist
        robot.drive(twist.v, twist.w)
    assert robot.pose.position == pytest.approx((12.0, 0.0), abs=0.1)


@pytest.mark.parametrize("kind", [RolloutController, PursuitController])
@pytest.mark.parametrize("limits", WEAK)
def test_robot_with_weak_brakes_stops_before_a_wall(
    kind: type[RolloutController] | type[PursuitController], limits: Limits
) -> None:
    controller = kind(Manoeuvres(Footprint.disc(0.3)))
    robot = Robot(ORIGIN, [], limits=limits)
    path = np.column_stack([np.linspace(0.0, 25.0, 501), np.zeros(501)])
    for _ in range(900):
        now = Situation(robot.pose, robot.twist, wall(18.0, -4.0, 4.0), limits)
        twist = controller.follow(now, path).twist
        robot.drive(twist.v, twist.w)
        assert robot.pose.x + 0.3 < 18.0
    assert robot.fastest > 0.9 * limits.max_velocity
    assert robot.pose.x > 15.0
    assert robot.twist.v == 0.0


@pytest.mark.parametrize("limits", WEAK)
@pytest.mark.parametrize("way", [1.0, -1.0], ids=["forwards", "backwards"])
def test_robot_with_weak_brakes_is_not_driven_by_hand_into_a_wall(limits: Limits, way: float) -> None:
    manoeuvres = Manoeuvres(Footprint.disc(0.3))
    robot = Robot(ORIGIN, [], limits=limits)
    asked = Twist2D(way * limits.max_velocity, 0.0)
    for _ in range(900):
        now = Situation(robot.pose, robot.twist, way * wall(18.0, -4.0, 4.0), limits)
        twist = now.reachable(asked if manoeuvres.can_drive(now, asked) else Twist2D())
        robot.drive(twist.v, twist.w)
        assert abs(robot.pose.x) + 0.3 < 18.0
    assert robot.fastest > 0.9 * limits.max_velocity
    assert abs(robot.pose.x) > 15.0


def test_backing_up_needs_a_free_rear() -> None:
    free = Situation(ORIGIN, Twist2D(), wall(0.2), Limits())
    confined = Situation(ORIGIN, Twist2D(), wall(-0.26), Limits())
    assert MANOEUVRES.can_back_up(free, 0.15)
    assert MANOEUVRES.back_up(free, 0.05).twist.v == pytest.approx(-0.05)
    assert not MANOEUVRES.can_back_up(confined, 0.15)
    assert MANOEUVRES.back_up(confined, 0.05).blocked


def test_robot_that_may_not_drive_stands() -> None:
    assert settle(NOTHING, AHEAD, Limits(max_velocity=0.0)).v == 0.0


@settings(max_examples=60, deadline=None)
@given(
    x=st.floats(-0.5, 0.5),
    y=st.floats(-0.5, 0.5),
    front=st.floats(0.05, 0.3),
    half_width=st.floats(0.05, 0.3),
)
def test_distance_to_the_outline_is_that_to_a_rectangle(x: float, y: float, front: float, half_width: float) -> None:
    outline = Footprint(front=front, rear=0.2, half_width=half_width)
    edges_x = np.linspace(-0.2, front, 400)
    edges_y = np.linspace(-half_width, half_width, 400)
    edge = np.concatenate(
        [
            np.column_stack([edges_x, np.full(400, half_width)]),
            np.column_stack([edges_x, np.full(400, -half_width)]),
            np.column_stack([np.full(400, front), edges_y]),
            np.column_stack([np.full(400, -0.2), edges_y]),
        ]
    )
    distance = np.hypot(edge[:, 0] - x, edge[:, 1] - y).min()
    inside = -0.2 < x < front and abs(y) < half_width
    assert outline.nearest(np.array([x - outline.centre]), np.array([y])) == pytest.approx(
        -distance if inside else distance, abs=2e-3
    )


@given(x=st.floats(-0.5, 0.5), y=st.floats(-0.5, 0.5), radius=st.floats(0.02, 0.4))
def test_distance_to_a_disc_is_that_to_its_middle_less_its_radius(x: float, y: float, radius: float) -> None:
    disc = Footprint.disc(radius)
    assert disc.circumradius == pytest.approx(radius)
    assert disc.nearest(np.array([x]), np.array([y])) == pytest.approx(math.hypot(x, y) - radius, abs=1e-9)


@settings(max_examples=150, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    count=st.integers(0, 80),
    v=st.floats(-0.1, 0.26),
    w=st.floats(-1.0, 1.0),
    reach=st.floats(0.0, 0.5),
    outline=st.sampled_from([Footprint(), Footprint.disc(0.25), Footprint(0.1, 0.25, 0.18, 0.05)]),
)
def test_points_that_no_rollout_passes_change_no_clearance_within_reach(
    seed: int, count: int, v: float, w: float, reach: float, outline: Footprint
) -> None:
    points = np.random.default_rng(seed).uniform(-1.5, 1.5, (count, 2))
    tried = forecast(candidates(Limits()), Twist2D(v, w), Limits(), 1.5, 0.15)
    every = tried.clearances(outline, points)
    passed = tried.clearances(outline, tried.passed(points, outline.circumradius + reach + 0.01))
    assert np.array_equal(np.minimum(every, reach), np.minimum(passed, reach))


def test_corners_that_do_not_fit_into_an_outline_are_refused() -> None:
    with pytest.raises(ValueError, match="do not fit"):
        Footprint(front=0.1, rear=0.1, half_width=0.05, rounding=0.06)
