"""Scans of depth images have the ranges that the geometry of the camera gives."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.planar import FloatArray
from regraft.services.scans.depth_scan import BadView, DepthScan, View, axes_of

LEVEL = np.eye(3)
EVERYWHERE = (0.0, 100.0)
QUARTER = math.pi / 2


def pitched(angle: float) -> FloatArray:
    """Return the axes of a camera that looks down by an angle."""
    return axes_of(0.0, math.sin(angle / 2), 0.0, math.cos(angle / 2))


def rolled(angle: float) -> FloatArray:
    """Return the axes of a camera that lies on its side by an angle."""
    return axes_of(math.sin(angle / 2), 0.0, 0.0, math.cos(angle / 2))


def small(depths: list[list[float]], band: tuple[float, float] = EVERYWHERE, beams: int = 2) -> list[float]:
    """Return the ranges of an image of 2 rows and 4 columns, a quarter turn wide, 0.3 m above the floor."""
    image = np.array(depths, np.float32)
    scan = DepthScan(View(LEVEL, 0.3, QUARTER, (2, 4)), beams, band, (0.5, 8.0))
    return [float(each) for each in scan.ranges(image)]


def test_a_post_in_the_leftmost_column_is_at_its_planar_distance_in_the_left_beam() -> None:
    post = [[1.0, math.inf, math.inf, math.inf]] * 2
    # Two directions of the left beam are looked at, 11.25 and 33.75 degrees. The second lies in that column.
    assert small(post) == [math.inf, pytest.approx(1.0 / math.cos(math.radians(33.75)), abs=1e-6)]


def test_the_nearest_row_counts() -> None:
    rows = [[1.0] * 4, [0.9] * 4]
    assert small(rows) == pytest.approx([0.9 / math.cos(math.radians(11.25))] * 2, abs=1e-6)


def test_the_beams_divide_the_field_of_view_and_nothing_beyond() -> None:
    scan = DepthScan(View(LEVEL, 0.3, QUARTER, (2, 4)), 3, EVERYWHERE, (0.5, 8.0))
    assert scan.angle_increment == pytest.approx(QUARTER / 3)
    assert scan.angle_min == pytest.approx(-QUARTER / 3)
    assert DepthScan(View(LEVEL, 0.3, QUARTER, (2, 4)), 0, EVERYWHERE, (0.5, 8.0)).beams == 4


@pytest.mark.parametrize(
    ("band", "hits"),
    [((0.0, 1.0), True), ((0.9, 1.0), False), ((0.75, 1.0), True), ((0.0, 0.1), False), ((0.0, 0.2), False)],
)
def test_only_points_in_the_band_of_heights_count(band: tuple[float, float], hits: bool) -> None:
    # At a depth of 2 m the upper row is 0.5 m above the camera, the lower one as far below: under the floor.
    assert math.isfinite(small([[2.0] * 4] * 2, band)[0]) is hits


def test_what_is_beyond_reach_is_not_there() -> None:
    assert small([[8.5] * 4, [math.inf] * 4]) == [math.inf, math.inf]
    # 7.6 m along the axis is beyond 8 m at the outer beams of four.
    far = small([[7.6] * 4] * 2, beams=4)
    assert [math.isfinite(each) for each in far] == [False, True, True, False]


def test_what_is_too_near_is_minus_infinity_unless_it_may_be_the_floor() -> None:
    near, far = [-math.inf] * 4, [math.inf] * 4
    # At 0.5 m the rows are 0.425 and 0.175 m above the floor.
    assert small([near, far]) == [-math.inf] * 2
    assert small([far, near], (0.1, 1.0)) == [-math.inf] * 2
    assert small([far, near], (0.2, 1.0)) == [math.inf] * 2


def test_a_depth_that_is_no_number_is_no_point() -> None:
    assert small([[math.nan] * 4] * 2) == [math.inf] * 2


@pytest.mark.parametrize("beams", [1, 7, 40, 160, 400])
def test_no_column_is_left_out(beams: int) -> None:
    scan = DepthScan(View(LEVEL, 0.3, 1.5, (3, 160)), beams, EVERYWHERE, (0.1, 8.0))
    for column in range(160):
        image = np.full((3, 160), np.inf, np.float32)
        image[:, column] = 2.0
        assert np.isfinite(scan.ranges(image)).any(), column


@settings(max_examples=40, deadline=None)
@given(
    pitch=st.floats(-0.3, 0.3),
    wall=st.floats(-0.5, 0.5),
    distance=st.floats(0.8, 4.0),
    heading=st.floats(-3.0, 3.0),
    seed=st.integers(0, 100),
)
def test_a_wall_is_at_its_distance_in_all_beams_within_the_noise(
    pitch: float, wall: float, distance: float, heading: float, seed: int
) -> None:
    width, height, opening, noise = 80, 9, 1.4, 0.01
    slope = math.tan(opening / 2)
    across = (np.arange(width) + 0.5 - width / 2) * (2 * slope / width)
    down = (np.arange(height) + 0.5 - height / 2) * (2 * slope / width)
    rays = np.stack(np.broadcast_arrays(1.0, -across[None, :], -down[:, None]))
    normal = np.array([math.cos(wall), math.sin(wall), 0.0])
    depths = distance / np.tensordot(normal, np.tensordot(pitched(pitch), rays, 1), 1)
    depths += np.random.default_rng(seed).uniform(-noise, noise, depths.shape)
    turned = np.array(
        [[math.cos(heading), -math.sin(heading), 0], [math.sin(heading), math.cos(heading), 0], [0, 0, 1]]
    )
    view = View(turned @ pitched(pitch), 50.0, opening, (height, width))
    scan = DepthScan(view, 0, EVERYWHERE, (0.1, 1000.0))
    ranges = scan.ranges(depths.astype(np.float32))
    bearings = scan.angle_min + scan.angle_increment * np.arange(scan.beams) - wall
    # A beam and a pixel have a width, in which the nearest point counts.
    around = distance / np.cos(bearings + 2 * scan.angle_increment * np.linspace(-1, 1, 5)[:, None])
    assert (ranges >= 0.98 * around.min(axis=0) - 2 * noise).all()
    assert (ranges <= 1.02 * around.max(axis=0) + 2 * noise).all()


def test_a_tilted_camera_has_the_bearings_that_all_its_rows_see() -> None:
    level = DepthScan(View(LEVEL, 0.3, QUARTER, (3, 8)), 0, EVERYWHERE, (0.1, 8.0))
    down = DepthScan(View(pitched(0.4), 0.3, QUARTER, (3, 8)), 0, EVERYWHERE, (0.1, 8.0))
    up = DepthScan(View(pitched(-0.4), 0.3, QUARTER, (3, 8)), 0, EVERYWHERE, (0.1, 8.0))
    assert down.angle_increment == pytest.approx(up.angle_increment)
    # The row that looks least steeply sees the fewest bearings: atan(1 / (cos 0.4 + 0.25 sin 0.4)) to each side.
    half = math.atan(1.0 / (math.cos(0.4) + 0.25 * math.sin(0.4)))
    assert down.angle_increment * 8 == pytest.approx(2 * half)
    assert level.angle_increment * 8 == pytest.approx(QUARTER)


@pytest.mark.parametrize(("axes", "why"), [(pitched(1.5), "must look ahead"), (rolled(1.5), "tilted so far")])
def test_a_view_that_makes_no_scan_is_refused(axes: FloatArray, why: str) -> None:
    with pytest.raises(BadView, match=why):
        DepthScan(View(axes, 0.3, QUARTER, (30, 40)), 0, EVERYWHERE, (0.1, 8.0))


def test_a_camera_that_hangs_upside_down_has_its_left_on_the_right() -> None:
    scan = DepthScan(View(rolled(math.pi), 0.3, QUARTER, (2, 4)), 2, EVERYWHERE, (0.5, 8.0))
    image = np.full((2, 4), np.inf, np.float32)
    image[:, 0] = 1.0
    assert [math.isfinite(each) for each in scan.ranges(image)] == [True, False]
