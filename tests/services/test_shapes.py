"""Promises of finding hydrants by shape, and of placing them, on drawn pictures."""

import math

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.bus_schema.messages.geometry import Pose, Quaternion, Vector3
from regraft.services.detector.detector import NEAR_ENOUGH
from regraft.services.detector.hydrant import Candidate, find_hydrant
from regraft.services.detector.silhouette import FOOT_RADIUS, HEIGHT, half_widths
from regraft.services.detector.view import View

RED = (160, 10, 10)
GREY = (150, 150, 145)


def canvas() -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    return np.full((240, 320, 3), GREY, np.uint8)


def drawn_hydrant(height: int, axis: float, caps: float) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """Draw a hydrant ``height`` px high whose caps stick out by a share of the most they can."""
    image = canvas()
    metres = HEIGHT / height
    heights = HEIGHT - (np.arange(height) + 0.5) * metres
    least, most = half_widths(np.asarray(heights, np.float64))
    widths = least + caps * (most - least)
    columns = np.arange(320) + 0.5
    for row, width in enumerate(widths):
        image[60 + row, np.abs(columns - axis) * metres < width] = RED
    return image


@settings(deadline=None)
@given(st.integers(16, 170), st.floats(80.0, 240.0), st.floats(0.0, 1.0))
def test_a_drawn_hydrant_is_found_at_its_axis_and_height(height: int, axis: float, caps: float) -> None:
    found = find_hydrant(drawn_hydrant(height, axis, caps))
    assert len(found) == 1
    assert abs(found[0].axis - axis) <= 1.0
    assert (found[0].top, found[0].bottom) == (60, 60 + height)


@settings(deadline=None)
@given(st.integers(1, 200), st.integers(1, 200), st.integers(0, 100), st.integers(0, 100))
def test_no_red_rectangle_is_a_hydrant(width: int, height: int, left: int, top: int) -> None:
    image = canvas()
    image[top : top + height, left : left + width] = RED
    assert find_hydrant(image) == ()


SEVEN_BY_NINE = {(3, 4), (4, 3)}
"""The half axes of ellipses of which so few pixels are left that they may look like a hydrant."""


@settings(deadline=None)
@given(st.integers(2, 90), st.integers(2, 90), st.floats(0.0, 180.0))
def test_no_red_ball_or_ellipse_is_a_hydrant_unless_it_is_as_slim(half: int, other: int, angle: float) -> None:
    image = canvas()
    slim = max(half, other) / min(half, other)
    cv2.ellipse(image, (160, 120), (half, other), angle, 0.0, 360.0, RED, -1)
    if slim < 1.5 and (half, other) not in SEVEN_BY_NINE:
        assert find_hydrant(image) == ()


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_sensors_noise_is_no_hydrant(seed: int) -> None:
    random = np.random.default_rng(seed)
    brightness = random.uniform(0.0, 200.0)
    noise = random.normal(brightness, 12.0, (120, 160, 3))
    assert find_hydrant(np.clip(noise, 0.0, 255.0).astype(np.uint8)) == ()


@settings(deadline=None)
@given(st.floats(1.0, 4.5), st.floats(-0.4, 0.4), st.floats(0.05, 0.6), st.floats(-0.05, 0.05))
def test_a_hydrant_on_the_floor_is_placed_where_it_stands(
    depth: float, aside: float, above: float, pitch: float
) -> None:
    down = Quaternion(y=math.sin(pitch / 2), w=math.cos(pitch / 2))
    view = View.of(640, 480, 1.09, Pose(Vector3(0.0, 0.0, above), down), 0.0)

    def row(drop: float, ahead: float) -> float:
        return view.centre[1] + view.focal * math.tan(math.atan2(drop, ahead) - pitch)

    top, bottom = round(row(above - HEIGHT, depth)), round(row(above, depth - FOOT_RADIUS))
    candidate = Candidate(1.0, view.centre[0] - view.focal * aside, top, bottom)
    assert abs(view.depth(candidate) / depth - 1.0) < 0.08
    assert math.isclose(math.tan(view.bearing(candidate.axis)), aside, abs_tol=1e-9)
    assert view.floor_error(candidate) < NEAR_ENOUGH
    sunk = Candidate(1.0, candidate.axis, top + 60, bottom + 60)
    assert view.floor_error(sunk) > view.floor_error(candidate)
