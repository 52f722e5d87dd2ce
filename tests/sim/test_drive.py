"""Promises about driving and odometry."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.planar import Pose2D
from regraft.sim_service.devices.drive import DifferentialDrive
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import SceneError, load_scene
from regraft.sim_service.simulation import Simulation
from tests.support.worlds import WAFFLE, new_contacts, odometry_of, send_command, touched_by, truth_of, waffle

from .worlds import FROG, OUT_OF_THE_WAY, drive, frog_with_robot_at

DRIVE = frog_with_robot_at(0.0, 0.0, 0.0).robot().device("drive", DifferentialDrive)
SEGMENTS = [(0.26, 0.0, 4), (0.0, 1.82, 3), (0.2, 0.5, 4), (0.0, -1.0, 2), (-0.15, 0.0, 2), (0.1, 1.0, 2)]
"""Forward velocity (m/s), yaw rate (rad/s) and duration (s): 17 s with about 11 rad of turning."""


def test_odometry_agrees_with_truth_within_a_centimetre_after_17_s_of_driving() -> None:
    simulation = frog_with_robot_at(-0.9, -1.0, 0.2)
    for v, w, seconds in SEGMENTS:
        drive(simulation, v, w, seconds)
    truth, odometry = truth_of(simulation).pose, odometry_of(simulation).pose
    assert new_contacts(simulation) == ()
    assert math.hypot(truth.x - odometry.x, truth.y - odometry.y) < 0.01
    assert abs(truth.yaw - odometry.yaw) < math.radians(1.0)


@pytest.mark.parametrize(("v", "w"), [(0.26, 0.0), (-0.15, 0.0), (0.0, 1.0), (0.15, -0.5)])
def test_robot_moves_as_commanded(v: float, w: float) -> None:
    simulation = frog_with_robot_at(-0.5, -0.9, 0.0)
    drive(simulation, v, w, 1.0)
    start = truth_of(simulation).pose
    drive(simulation, v, w, 1.0)
    truth, odometry = truth_of(simulation), odometry_of(simulation)
    assert math.hypot(truth.pose.x - start.x, truth.pose.y - start.y) == pytest.approx(
        abs(v) if w == 0.0 else abs(2.0 * v / w * math.sin(w / 2.0)), abs=0.01
    )
    assert truth.twist.v == pytest.approx(v, abs=0.01)
    assert truth.twist.w == pytest.approx(w, abs=0.02)
    assert odometry.twist.v == pytest.approx(v, abs=0.005)
    assert odometry.twist.w == pytest.approx(w, abs=0.01)


@given(v=st.floats(-2.0, 2.0), w=st.floats(-10.0, 10.0))
def test_saturation_keeps_the_curvature(v: float, w: float) -> None:
    left, right = DRIVE.wheel_speeds(v, w)
    assert max(abs(left), abs(right)) <= 8.2 + 1e-9
    reached_v = (left + right) / 2.0 * DRIVE.wheel_radius
    reached_w = (right - left) / DRIVE.track * DRIVE.wheel_radius
    assert reached_v * w == pytest.approx(reached_w * v, abs=1e-9)
    assert reached_v * v >= 0.0
    assert abs(reached_v) <= abs(v) + 1e-12


@pytest.mark.parametrize(("v", "w"), [(1e308, 0.0), (1e308, -1e308), (-1e308, 1e307), (0.0, 1.7e308)])
def test_a_twist_whose_wheel_speeds_no_number_can_hold_is_slowed_like_any_other(v: float, w: float) -> None:
    assert DRIVE.wheel_speeds(v, w) == pytest.approx(DRIVE.wheel_speeds(v * 1e-300, w * 1e-300))


@given(v=st.floats(-0.13, 0.13), w=st.floats(-0.9, 0.9))
def test_reachable_twists_are_not_changed(v: float, w: float) -> None:
    left, right = DRIVE.wheel_speeds(v, w)
    assert (left + right) / 2.0 * DRIVE.wheel_radius == pytest.approx(v, abs=1e-12)
    assert (right - left) / DRIVE.track * DRIVE.wheel_radius == pytest.approx(w, abs=1e-12)


def test_robot_stops_when_commands_stay_away() -> None:
    simulation = frog_with_robot_at(-0.5, -0.9, 0.0)
    send_command(simulation, 0.2, 0.0)
    simulation.advance(0.4)
    assert truth_of(simulation).twist.v > 0.15
    simulation.advance(0.6)
    assert truth_of(simulation).twist.v == pytest.approx(0.0, abs=0.005)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_command_that_is_not_finite_is_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        send_command(frog_with_robot_at(0.0, 0.0, 0.0), bad, 0.0)


def test_odometry_starts_at_zero_when_told_so() -> None:
    simulation = frog_with_robot_at(-0.5, -0.9, 0.7, odometry={"at_start_pose": False})
    drive(simulation, 0.2, 0.0, 1.0)
    pose = odometry_of(simulation).pose
    assert pose.x == pytest.approx(0.2, abs=0.02)
    assert (pose.y, pose.yaw) == pytest.approx((0.0, 0.0), abs=1e-3)


def test_noisy_odometry_drifts_the_same_way_for_the_same_seed() -> None:
    noisy = {"travel_noise": 0.05}
    runs = [frog_with_robot_at(-0.9, -1.0, 0.2, odometry=noisy) for _ in range(2)]
    for simulation in runs:
        drive(simulation, 0.2, 0.0, 4.0)
    truth = truth_of(runs[0]).pose
    poses = [odometry_of(simulation).pose for simulation in runs]
    assert poses[0] == poses[1]
    assert math.hypot(truth.x - poses[0].x, truth.y - poses[0].y) > 0.01


def test_robot_pushing_a_wall_neither_tips_nor_passes_through_it() -> None:
    simulation = frog_with_robot_at(2.0, -0.5, 0.0)
    drive(simulation, 0.26, 0.0, 20.0)
    assert touched_by(simulation) == {"walls"}
    assert truth_of(simulation).pose.x + 0.069 < 2.36


VELOCITY = re.compile(r'<velocity (name="\w+") (joint="\w+") kv="1" (forcerange="[^"]*") ctrlrange="-8.2 8.2"/>')
WHEEL = re.compile(r'<body name="(\w+)_wheel" pos="0 (-?)\.1435 0">(.*?)</body>', re.DOTALL)


Build = Callable[[re.Match[str]], str]


def rebuilt(folder: Path, part: re.Pattern[str], other: str | Build) -> Simulation:
    """Return FROG with the robot at the middle, and a part of its file written in another way."""
    file, (text, count) = folder / "waffle.xml", part.subn(other, WAFFLE.read_text())
    assert count == 2
    file.write_text(text)
    placement = Placement({**OUT_OF_THE_WAY, "base": Pose2D(-0.5, -0.9, 0.0)})
    return Simulation(load_scene(FROG, (replace(waffle(), model=str(file)),)), seed=1, placement=placement)


@pytest.mark.parametrize(
    "actuator",
    [
        r'<velocity \1 \2 kv=".25" gear="2" \3 ctrlrange="-16.4 16.4"/>',
        r'<velocity \1 \2 kv="1" gear="-1" \3 ctrlrange="-8.2 8.2"/>',
        r'<general \1 \2 gainprm=".5" biastype="affine" biasprm="0 0 -1" \3 ctrlrange="-16.4 16.4"/>',
    ],
)
def test_a_robot_moves_as_commanded_whatever_unit_its_motors_signals_have(tmp_path: Path, actuator: str) -> None:
    simulation = rebuilt(tmp_path, VELOCITY, actuator)
    drive(simulation, 0.2, 0.3, 1.0)
    twist = truth_of(simulation).twist
    assert (twist.v, twist.w) == pytest.approx((0.2, 0.3), abs=0.02)
    fastest = simulation.robot().device("drive", DifferentialDrive).wheel_speeds(9.0, 0.0)
    assert fastest == pytest.approx((8.2, 8.2))


@pytest.mark.parametrize("kind", ["motor", "position"])
def test_wheels_whose_actuators_take_no_velocities_are_refused_by_name(tmp_path: Path, kind: str) -> None:
    with pytest.raises(SceneError, match=r"actuator 'left_wheel' must take a velocity"):
        rebuilt(tmp_path, VELOCITY, rf'<{kind} \1 \2 \3 ctrlrange="-8.2 8.2"/>')


@pytest.mark.parametrize("limits", ['ctrlrange="1 8.2"', ""])
def test_wheels_that_cannot_turn_both_ways_or_without_limit_are_refused_by_name(tmp_path: Path, limits: str) -> None:
    with pytest.raises(SceneError, match=r"actuator 'left_wheel' needs a ctrlrange"):
        rebuilt(tmp_path, VELOCITY, rf'<velocity \1 \2 kv="1" \3 {limits}/>')


def on_an_arm(wheel: re.Match[str]) -> str:
    """Hang a wheel on an arm that lies on its side."""
    side, sign, parts = wheel.groups()
    depth = ".0435" if sign else "-.0435"
    arm = f'<body name="{side}_arm" pos="0 {sign}.1 0" quat="1 1 0 0">'
    return f'{arm}<body name="{side}_wheel" pos="0 0 {depth}" quat="1 -1 0 0">{parts}</body></body>'


def with_a_hub(wheel: re.Match[str]) -> str:
    """Give a wheel a square hub, as its first geom."""
    side, sign, parts = wheel.groups()
    hub = '<geom type="box" size=".005 .012 .005" mass="0" contype="0" conaffinity="0"/>'
    return f'<body name="{side}_wheel" pos="0 {sign}.1435 0">{hub}{parts}</body>'


def cambered(wheel: re.Match[str]) -> str:
    """Lean a wheel outward by four degrees."""
    side, sign, parts = wheel.groups()
    return f'<body name="{side}_wheel" pos="0 {sign}.1435 0" quat=".99939 {sign or "-"}.0349 0 0">{parts}</body>'


@pytest.mark.parametrize("other", [on_an_arm, with_a_hub, cambered])
def test_track_and_radius_are_those_of_the_wheels_however_these_are_built(tmp_path: Path, other: Build) -> None:
    simulation = rebuilt(tmp_path, WHEEL, other)
    found = simulation.robot().device("drive", DifferentialDrive)
    assert (found.track, found.wheel_radius) == pytest.approx((DRIVE.track, DRIVE.wheel_radius))
    drive(simulation, 0.1, 0.3, 1.0)
    twist = truth_of(simulation).twist
    assert (twist.v, twist.w) == pytest.approx((0.1, 0.3), abs=0.02)


def test_wheels_that_are_not_round_are_refused_by_name(tmp_path: Path) -> None:
    square = re.compile(r'<geom name="\w+_tyre" class="wheel"/>')
    with pytest.raises(SceneError, match=r"joint 'left_wheel' has no round geom"):
        rebuilt(tmp_path, square, '<geom type="box" size=".03 .01 .03" mass=".05"/>')


JOINT = re.compile(r'<joint name="(\w+)" class="wheel"/>')
BODY = re.compile(r'<body name="(\w+_wheel)" pos="([^"]*)">')


@pytest.mark.parametrize(
    ("part", "other", "axis"),
    [
        (JOINT, r'<joint name="\1" class="wheel" axis="0 -1 0"/>', "0.00, -1.00, 0.00"),
        (BODY, r'<body name="\1" pos="\2" quat="0 0 0 1">', "0.00, -1.00, 0.00"),
        (BODY, r'<body name="\1" pos="\2" quat="1 0 0 -1">', "1.00, 0.00, 0.00"),
        (JOINT, r'<joint name="\1" class="wheel" axis="0 0 1"/>', "0.00, 0.00, 1.00"),
    ],
    ids=["joint to the right", "body turned round", "forward", "upward"],
)
def test_wheels_whose_axes_do_not_point_to_the_left_are_refused_by_name(
    tmp_path: Path, part: re.Pattern[str], other: str, axis: str
) -> None:
    with pytest.raises(SceneError, match=rf"the axis of joint 'left_wheel' must point to the left.*\({axis}\)"):
        rebuilt(tmp_path, part, other)
