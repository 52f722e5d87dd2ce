"""Poses in the plane are a group, and points move with them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft.bus_schema.messages.geometry import Quaternion
from regraft.planar import Pose2D, wrap_angle

LENGTHS = st.floats(-100.0, 100.0)
POSES = st.builds(Pose2D, LENGTHS, LENGTHS, st.floats(-math.pi, math.pi, exclude_min=True))
POINTS = st.lists(st.tuples(LENGTHS, LENGTHS), max_size=5).map(lambda rows: np.array(rows, float).reshape(-1, 2))


def close(one: Pose2D, other: Pose2D) -> bool:
    """Tell whether two poses are the same but for rounding."""
    return one.distance(other) < 1e-9 and abs(wrap_angle(one.yaw - other.yaw)) < 1e-9


@given(POSES, POSES)
def test_the_motion_between_two_poses_leads_from_one_to_the_other(one: Pose2D, other: Pose2D) -> None:
    assert close(one.compose(one.to(other)), other)
    assert close(one.compose(one.inverse()), Pose2D())


@given(POSES, POSES, POSES)
def test_it_does_not_matter_where_a_chain_of_poses_is_grouped(a: Pose2D, b: Pose2D, c: Pose2D) -> None:
    assert close(a.compose(b).compose(c), a.compose(b.compose(c)))


@given(POSES, POINTS)
def test_points_come_back_from_the_outer_frame(pose: Pose2D, points: np.ndarray) -> None:
    assert np.allclose(pose.inward(pose.outward(points)), points, atol=1e-9)
    assert np.allclose(pose.inverse().outward(points), pose.inward(points), atol=1e-9)


@given(st.floats(-math.pi, math.pi, exclude_min=True), st.floats(0.01, 100.0))
def test_a_quaternion_of_any_length_points_where_its_unit_quaternion_does(yaw: float, length: float) -> None:
    unit = Quaternion.from_yaw(yaw)
    scaled = Quaternion(z=length * unit.z, w=length * unit.w)
    assert abs(wrap_angle(scaled.yaw - yaw)) < 1e-5


@given(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda parts: math.hypot(*parts) > 0.01))
def test_a_unit_quaternion_is_not_scaled_again(parts: list[float]) -> None:
    x, y, z, w = (part / math.hypot(*parts) for part in parts)
    assert Quaternion(x, y, z, w).yaw == math.atan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2))


@pytest.mark.parametrize(
    ("turned", "yaw"),
    [
        (Quaternion(z=1.0, w=1.0), math.pi / 2),
        (Quaternion(z=0.5, w=0.5), math.pi / 2),
        (Quaternion(z=1e200, w=1e200), math.pi / 2),
        (Quaternion(z=-2.0, w=0.0), math.pi),
        (Quaternion(0.0, 0.0, 0.0, 0.0), 0.0),
    ],
)
def test_directions_as_people_write_them_are_meant_so(turned: Quaternion, yaw: float) -> None:
    assert abs(wrap_angle(turned.yaw - yaw)) < 1e-12


@given(st.floats(-1e3, 1e3))
def test_an_angle_is_wrapped_into_the_half_open_circle(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.isclose(math.cos(wrapped), math.cos(angle), abs_tol=1e-9)


@given(POSES, POSES)
def test_the_way_between_poses_begins_and_ends_at_them(one: Pose2D, other: Pose2D) -> None:
    assert close(one.interpolate(other, 0.0), one)
    assert close(one.interpolate(other, 1.0), other)
