"""What the global planner promises."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from regraft.planar import FloatArray, Point
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.navigator.planning.grid_planner import NO_POINTS, SPACING, GridPlanner, NoPath
from regraft.services.navigator.polyline import polyline_length

from .world import FROG_GOALS, Box, frog_map, rasterise

EMPTY = rasterise([], (60, 60), (0.0, 0.0))
WALL = Box(1.5, 1.0, 0.1, 2.0)  # from the lower edge of a 3 m map, open above y = 2


def gap_to_obstacles(path: FloatArray, grid: OccupancyGrid) -> FloatArray:
    """Return how far each of many points along a path is from the nearest occupied cell's square."""
    rows, columns = np.nonzero(grid.cells >= 65)
    if not len(rows):
        return np.full(len(path), math.inf)
    fine = np.concatenate([np.linspace(a, b, 6) for a, b in pairwise(path)])
    centres = grid.centres(rows, columns)
    beyond = np.abs(fine[:, None] - centres[None]) - grid.resolution / 2
    gaps: FloatArray = np.hypot(*np.moveaxis(np.maximum(beyond, 0.0), -1, 0)).min(axis=1)
    return gaps


def test_path_in_the_open_is_straight() -> None:
    path = GridPlanner(EMPTY).plan((0.33, 0.41), (2.71, 1.87))
    assert polyline_length(path) == pytest.approx(math.hypot(2.38, 1.46), rel=0.01)


def test_path_begins_and_ends_exactly_and_is_finely_divided() -> None:
    path = GridPlanner(EMPTY).plan((0.33, 0.41), (2.71, 1.87))
    assert path[0].tolist() == [0.33, 0.41]
    assert path[-1].tolist() == [2.71, 1.87]
    assert np.hypot(*np.diff(path, axis=0).T).max() <= SPACING + 1e-9


def test_path_to_where_the_robot_stands_has_no_length() -> None:
    assert polyline_length(GridPlanner(EMPTY).plan((1.0, 1.0), (1.0, 1.0))) == 0.0


def test_goal_behind_a_wall_is_reached_around_it() -> None:
    grid = rasterise([WALL], (60, 60), (0.0, 0.0))
    path = GridPlanner(grid).plan((0.8, 0.5), (2.2, 0.5))
    assert path[:, 1].max() > 2.2
    assert gap_to_obstacles(path, grid).min() >= 0.2


def test_path_keeps_more_than_the_robot_radius_where_that_costs_little() -> None:
    grid = rasterise([WALL], (60, 60), (0.0, 0.0))
    path = GridPlanner(grid).plan((0.5, 0.5), (2.5, 0.5))
    assert gap_to_obstacles(path, grid).min() >= 0.3


def test_goal_that_is_walled_in_has_no_path_and_the_error_says_so() -> None:
    walls = [Box(2, 1, 0.1, 2.1), Box(1, 2, 2.1, 0.1)]
    planner = GridPlanner(rasterise(walls, (60, 60), (0.0, 0.0)))
    with pytest.raises(NoPath, match=r"from \(2\.500, 2\.500\) to \(1\.000, 1\.000\).*leave no way"):
        planner.plan((2.5, 2.5), (1.0, 1.0))


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        ((-0.1, 1.0), (1.0, 1.0), "the start is outside the map"),
        ((0.5, 2.5), (1.0, 3.2), "the goal is outside the map, which spans x 0.00 to 3.00 m"),
        ((0.5, 2.5), (1.5, 1.0), "the goal is inside an obstacle"),
        ((1.5, 1.0), (0.5, 2.5), "the start is inside an obstacle"),
        ((0.5, 2.5), (math.nan, 1.0), "the goal is outside the map"),
    ],
)
def test_impossible_ends_are_named(start: tuple[float, float], goal: tuple[float, float], reason: str) -> None:
    with pytest.raises(NoPath, match=reason):
        GridPlanner(rasterise([WALL], (60, 60), (0.0, 0.0))).plan(start, goal)


def test_robot_that_stands_close_to_a_wall_finds_its_way_out() -> None:
    grid = rasterise([WALL], (60, 60), (0.0, 0.0))
    path = GridPlanner(grid).plan((1.38, 0.5), (0.5, 0.5))
    assert path[0].tolist() == [1.38, 0.5]
    assert gap_to_obstacles(path[8:], grid).min() >= 0.2


def test_goal_close_to_a_wall_is_not_reached_through_the_wall() -> None:
    grid = rasterise([WALL], (60, 60), (0.0, 0.0))
    path = GridPlanner(grid).plan((1.38, 0.5), (1.62, 0.5))
    assert path[:, 1].max() > 2.2
    assert gap_to_obstacles(path, grid).min() > 0.0


def test_obstacles_that_the_map_lacks_are_avoided_too() -> None:
    seen = np.column_stack([np.full(20, 1.5), np.linspace(0.6, 1.4, 20)])
    path = GridPlanner(EMPTY).plan((0.5, 1.0), (2.5, 1.0), seen)
    gaps = np.hypot(path[:, None, 0] - seen[:, 0], path[:, None, 1] - seen[:, 1])
    assert gaps.min() >= 0.22


def test_obstacles_that_close_the_last_way_leave_no_path() -> None:
    planner = GridPlanner(rasterise([WALL], (60, 60), (0.0, 0.0)))
    seen = np.column_stack([np.full(21, 1.5), np.linspace(2.0, 3.0, 21)])
    with pytest.raises(NoPath, match="and those seen"):
        planner.plan((0.5, 0.5), (2.5, 0.5), seen)
    assert len(planner.plan((0.5, 0.5), (2.5, 0.5)))


def test_unknown_ground_is_crossed_only_if_allowed() -> None:
    cells = EMPTY.cells.copy()
    cells[:, 28:32] = -1
    unknown_strip = OccupancyGrid(cells, 0.05, 0.0, 0.0)
    assert len(GridPlanner(unknown_strip).plan((0.5, 1.0), (2.5, 1.0)))
    with pytest.raises(NoPath):
        GridPlanner(unknown_strip, cross_unknown=False).plan((0.5, 1.0), (2.5, 1.0))


@pytest.mark.parametrize("goal", FROG_GOALS)
def test_goal_inside_an_object_is_approached_to_where_the_robot_can_stand_and_turn(
    goal: tuple[float, float],
) -> None:
    planner = GridPlanner(frog_map())
    target = planner.approach((1.7, -1.7), goal, tolerance=0.5)
    assert math.dist(goal, target) <= 0.5
    assert planner.clearance(np.array([target]))[0] >= 0.3
    assert len(planner.plan((1.7, -1.7), target))


def test_free_goal_is_approached_as_it_is() -> None:
    assert GridPlanner(frog_map()).approach((1.7, -1.7), (0.31, 0.17), tolerance=0.5) == (0.31, 0.17)


@st.composite
def cluttered_rooms(draw: st.DrawFn) -> NDArray[np.int8]:
    """Rooms of 2 x 2 m with a few boxes."""
    cells = np.zeros((40, 40), np.int8)
    for _ in range(draw(st.integers(0, 6))):
        row, column = draw(st.integers(0, 39)), draw(st.integers(0, 39))
        cells[row : row + draw(st.integers(1, 12)), column : column + draw(st.integers(1, 12))] = 100
    return cells


ANYWHERE = st.tuples(st.floats(0.0, 1.999), st.floats(0.0, 1.999))


@settings(max_examples=60, deadline=None)
@given(cells=cluttered_rooms(), start=ANYWHERE, goal=ANYWHERE)
def test_path_joins_its_ends_and_keeps_off_obstacles_in_any_room(
    cells: NDArray[np.int8], start: tuple[float, float], goal: tuple[float, float]
) -> None:
    grid = OccupancyGrid(cells, 0.05, 0.0, 0.0)
    planner = GridPlanner(grid)
    try:
        path = planner.plan(start, goal)
    except NoPath:
        return
    assert path[0].tolist() == list(start)
    assert path[-1].tolist() == list(goal)
    gaps = gap_to_obstacles(path, grid)
    assert gaps.min(initial=math.inf) >= 0.0
    near_ends = np.minimum(np.hypot(*(path - np.array(start)).T), np.hypot(*(path - np.array(goal)).T)) <= 0.22 + 0.15
    inner = path[~near_ends]
    # A path's cells are all free; cells are known to half their diagonal.
    assert planner.clearance(inner).min(initial=math.inf) >= 0.22


@settings(max_examples=40, deadline=None)
@given(cells=cluttered_rooms(), start=ANYWHERE, goal=ANYWHERE)
def test_way_back_exists_wherever_the_way_there_does(
    cells: NDArray[np.int8], start: tuple[float, float], goal: tuple[float, float]
) -> None:
    planner = GridPlanner(OccupancyGrid(cells, 0.05, 0.0, 0.0))
    found = []
    for here, there in ((start, goal), (goal, start)):
        try:
            planner.plan(here, there)
            found.append(True)
        except NoPath:
            found.append(False)
    assert found[0] == found[1]


def outcome(planner: GridPlanner, start: Point, goal: Point, seen: FloatArray) -> list[list[float]] | None:
    """Return the exact path, or None if there is none."""
    try:
        path: list[list[float]] = planner.plan(start, goal, seen).tolist()
    except NoPath:
        return None
    return path


SPOTS = st.lists(st.tuples(st.integers(0, 39), st.integers(0, 39)), max_size=12)


@settings(max_examples=60, deadline=None)
@given(cells=cluttered_rooms(), start=ANYWHERE, goal=ANYWHERE, spots=SPOTS)
def test_obstacles_that_were_seen_lead_to_the_path_of_a_map_that_has_them(
    cells: NDArray[np.int8], start: Point, goal: Point, spots: list[tuple[int, int]]
) -> None:
    grid = OccupancyGrid(cells, 0.05, 0.0, 0.0)
    with_them = cells.copy()
    rows, columns = np.array(spots, np.intp).reshape(-1, 2).T
    with_them[rows, columns] = 100
    seen = outcome(GridPlanner(grid), start, goal, grid.centres(rows, columns))
    assert seen == outcome(GridPlanner(OccupancyGrid(with_them, 0.05, 0.0, 0.0)), start, goal, NO_POINTS)


@settings(max_examples=40, deadline=None)
@given(cells=cluttered_rooms(), start=ANYWHERE, goal=ANYWHERE, story=st.lists(SPOTS, max_size=4))
def test_obstacles_that_came_and_went_leave_no_trace_in_plans(
    cells: NDArray[np.int8], start: Point, goal: Point, story: list[list[tuple[int, int]]]
) -> None:
    grid = OccupancyGrid(cells, 0.05, 0.0, 0.0)
    planner = GridPlanner(grid)
    for spots in (*story, story[0] if story else [], []):
        seen = grid.centres(*np.array(spots, np.intp).reshape(-1, 2).T)
        assert outcome(planner, start, goal, seen) == outcome(GridPlanner(grid), start, goal, seen)


@pytest.mark.parametrize("half", range(2, 9))
def test_equal_ways_around_an_obstacle_are_chosen_between_as_on_a_map_that_has_it(half: int) -> None:
    grid = OccupancyGrid(np.zeros((81, 81), np.int8), 0.05, 0.0, 0.0)
    rows, columns = (np.ravel(part) for part in np.mgrid[40 - half : 41 + half, 40 - half : 41 + half])
    with_it = grid.cells.copy()
    with_it[rows, columns] = 100
    start, goal = (2.025, 0.725), (2.025, 3.325)
    seen = outcome(GridPlanner(grid), start, goal, grid.centres(rows, columns))
    assert seen is not None
    assert seen == outcome(GridPlanner(OccupancyGrid(with_it, 0.05, 0.0, 0.0)), start, goal, NO_POINTS)


def test_a_path_that_its_user_changes_is_planned_again_as_it_was() -> None:
    planner = GridPlanner(EMPTY)
    first = planner.plan((0.33, 0.41), (2.71, 1.87))
    kept = first.tolist()
    first += 1.0
    assert planner.plan((0.33, 0.41), (2.71, 1.87)).tolist() == kept
