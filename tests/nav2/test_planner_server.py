"""The planner server: paths, their checks, their smoothing, costs, and clearing; each asked by itself."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from regraft import CallFailed, RefusalCode
from regraft.bus_schema.messages.nav2.paths import (
    MAX_POSES,
    NO_VIAPOINTS,
    ClearCostmap,
    ComputedPath,
    ComputePathThroughPoses,
    CostmapCleared,
    Costs,
    GetCosts,
    Path,
    PathValidity,
    PlanarPose,
    PlanError,
    SmoothedPath,
    SmoothError,
    SmoothPath,
    ValidatePath,
)
from regraft.component.goal import Goal
from regraft.planar import Pose2D
from regraft.services.navigator.driving.robot import Footprint
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.services.navigator.planning.grid_planner import NO_POINTS, GridPlanner
from regraft.services.navigator.planning.terrain import Inflation, Terrain
from regraft.services.navigator.servers.costs import LETHAL, footprint_cost
from regraft.services.navigator.servers.planner_server import PlannerServer
from regraft.services.navigator.servers.planning import PathFinder
from regraft.testing import Rig

from ..navigator.stage import ROOM, Stage, room_map
from ..navigator.world import Box
from .bench import START, Bench, framed

BLOCK = Box(2.0, 2.0, 1.6, 1.6)
CHAIR = Box(2.0, 2.0, 0.4, 0.4)
CLEAR = "global_costmap/clear_entirely_global_costmap"
LINE = Path(0.0, "map", tuple(PlanarPose(0.6 + 0.05 * step, 2.0) for step in range(57)))


@pytest.fixture
def bench() -> Iterator[Bench]:
    """Return a robot at the left side of an empty room."""
    with Rig() as rig:
        yield Bench.of(rig)


def validity(bench: Bench, path: Path, **more: Any) -> PathValidity:
    return bench.rig.call("is_path_valid", ValidatePath(path, **more), PathValidity)


def costs(bench: Bench, *places: tuple[float, float], outline: bool = False) -> tuple[float, ...]:
    poses = tuple(framed(x, y) for x, y in places)
    return bench.rig.call("global_costmap/get_cost_global_costmap", GetCosts(poses, outline), Costs).costs


def test_a_path_leads_from_the_robot_to_the_goal_and_ends_with_its_heading(bench: Bench) -> None:
    rows = bench.plan(3.4, 2.0, 1.2).path.rows
    assert rows[0, :2] == pytest.approx(START.position)
    assert rows[-1].tolist() == pytest.approx([3.4, 2.0, 1.2])
    assert np.abs(rows[:-1, 2]).max() < 0.2, "each pose looks at the next one"
    assert np.hypot(*np.diff(rows[:, :2], axis=0).T).max() < 0.1


def test_a_path_may_start_elsewhere_and_pass_viapoints(bench: Bench) -> None:
    rows = bench.plan(3.4, 2.0, start=framed(1.0, 3.0), viapoints=(framed(2.0, 1.0),)).path.rows
    assert rows[0, :2] == pytest.approx([1.0, 3.0])
    assert np.hypot(rows[:, 0] - 2.0, rows[:, 1] - 1.0).min() < 0.02


def test_a_path_through_poses_passes_each(bench: Bench) -> None:
    places = [(1.2, 3.2), (2.4, 0.9), (3.4, 2.0)]
    goal = ComputePathThroughPoses(tuple(framed(*place) for place in places))
    rows = bench.do("compute_path_through_poses", goal, ComputedPath).path.rows
    for x, y in places:
        assert np.hypot(rows[:, 0] - x, rows[:, 1] - y).min() < 0.02


def test_what_was_seen_is_gone_around_and_a_static_planner_ignores_it(bench: Bench) -> None:
    bench.surprise(CHAIR)
    bench.run(1.0)
    around, through = bench.plan(3.4, 2.0).path.rows, bench.plan(3.4, 2.0, planner="StaticGrid").path.rows
    assert np.abs(around[:, 1] - 2.0).max() > 0.3
    assert np.abs(through[:, 1] - 2.0).max() < 0.1


@pytest.mark.parametrize(
    ("x", "y", "more", "code", "why"),
    [
        (9.0, 2.0, {}, PlanError.GOAL_OUTSIDE_MAP, "outside the map, which spans"),
        (2.0, 2.0, {}, PlanError.GOAL_OCCUPIED, "inside an obstacle of the map"),
        (3.4, 2.0, {"start": framed(-9.0, 2.0)}, PlanError.START_OUTSIDE_MAP, "the start (-9.000, 2.000)"),
        (3.4, 2.0, {"start": framed(2.0, 2.0)}, PlanError.START_OCCUPIED, "the start"),
        (3.4, 2.0, {"planner": "GridBaset"}, PlanError.INVALID_PLANNER, "did you mean 'GridBased'?"),
        (3.4, 2.0, {"start": framed(0.6, 2.0, frame="moon")}, PlanError.NO_POSE, "must be map or odom, is 'moon'"),
    ],
)
def test_a_path_that_cannot_be_is_reported_with_nav2s_code(
    x: float, y: float, more: dict[str, Any], code: PlanError, why: str
) -> None:
    with Rig() as rig:
        found = Bench.of(rig, START, [*ROOM, BLOCK]).plan(x, y, **more)
    assert (found.error_code, found.path.poses) == (code, ())
    assert why in found.error_msg


def test_a_walled_off_goal_has_no_valid_path(bench: Bench) -> None:
    bench.stage.show_map(room_map([*ROOM, Box(2.0, 2.0, 0.1, 4.0)]))
    found = bench.plan(3.4, 2.0)
    assert found.error_code == PlanError.NO_VALID_PATH
    through = ComputePathThroughPoses((framed(0.6, 3.0), framed(3.4, 2.0)))
    assert bench.do("compute_path_through_poses", through, ComputedPath).error_code == PlanError.NO_VALID_PATH + 100


def test_a_goal_close_to_a_wall_is_approached(bench: Bench) -> None:
    found = bench.plan(3.4, 3.95)
    assert found.error_code == 0
    assert 3.4 < found.path.rows[-1, 1] < 3.9


def to_and_fro(times: int) -> ComputePathThroughPoses:
    """Return a way between two corners of the room."""
    return ComputePathThroughPoses((framed(0.6, 0.6), framed(3.4, 3.4)) * times)


@pytest.mark.parametrize(("times", "expected"), [(3, 0), (25, 0), (60, 2)])
def test_others_have_their_turn_while_a_path_through_very_many_poses_is_found(times: int, expected: int) -> None:
    pauses: list[int] = []

    async def pause() -> None:
        pauses.append(len(pauses))

    finder = PathFinder(GridPlanner(room_map(ROOM)), NO_POINTS, 0.5)
    rows = asyncio.run(finder.through(0.0, START, to_and_fro(times).goals, pause)).rows
    assert np.count_nonzero(np.hypot(rows[:, 0] - 3.4, rows[:, 1] - 3.4) < 0.02) >= times
    assert len(pauses) == expected


def test_a_path_that_is_too_long_is_reported_with_nav2s_code(bench: Bench) -> None:
    found = bench.do("compute_path_through_poses", to_and_fro(250), ComputedPath)
    assert (found.error_code, found.path.poses) == (PlanError.UNKNOWN + 100, ())
    assert str(MAX_POSES) in found.error_msg


def test_no_poses_have_a_code_of_their_own(bench: Bench) -> None:
    found = bench.do("compute_path_through_poses", ComputePathThroughPoses(()), ComputedPath)
    assert found.error_code == NO_VIAPOINTS


def test_without_a_map_a_goal_is_refused_in_time() -> None:
    with Rig() as rig:
        rig.add(PlannerServer, "planner", {"ready_within": 1.0})
        through = ComputePathThroughPoses((framed(1.0, 1.0),))
        goal: Goal[ComputedPath, Any] = rig.goal("compute_path_through_poses", through, ComputedPath)
        rig.advance(1.2)
        assert isinstance(goal.error, CallFailed)
        assert "no odometry has come and no usable map has come within 1 s" in goal.error.why
        assert rig.call("is_path_valid", ValidatePath(LINE), PathValidity) == PathValidity(False, False)


def test_a_server_that_looks_seldom_answers_by_the_latest_scan() -> None:
    with Rig() as rig:
        stage = Stage.of(rig, PlannerServer, START, None, {"update_frequency": 2.0})
        stage.run(1.1)
        stage.robot.boxes = [*ROOM, CHAIR]
        stage.run(0.3)
        found = rig.call("is_path_valid", ValidatePath(LINE), PathValidity)
        assert (found.success, found.is_valid) == (True, False)


def test_a_path_is_invalid_where_something_stands_on_it(bench: Bench) -> None:
    assert validity(bench, LINE) == PathValidity(True, True)
    bench.surprise(CHAIR)
    bench.run(1.0)
    first = validity(bench, LINE)
    every = validity(bench, LINE, stop_at_first_collision=False)
    assert not first.is_valid
    assert len(first.invalid_pose_indices) == 1
    assert len(every.invalid_pose_indices) > 5
    assert first.invalid_pose_indices[0] == every.invalid_pose_indices[0]
    assert LINE.poses[first.invalid_pose_indices[0]].x == pytest.approx(1.65, abs=0.1)
    assert validity(bench, LINE, max_lookahead_distance=0.5).is_valid
    assert validity(bench, LINE, layer="static").is_valid
    bench.clear_away()
    bench.run(2.0)
    assert validity(bench, LINE).is_valid


def test_the_part_of_a_path_behind_the_robot_does_not_count() -> None:
    with Rig() as rig:
        bench = Bench.of(rig, Pose2D(2.8, 2.0, 0.0), [*ROOM, Box(1.0, 2.0, 0.2, 0.2)])
        assert validity(bench, LINE).is_valid


def test_an_empty_path_is_not_valid_and_an_unknown_layer_is_refused(bench: Bench) -> None:
    assert validity(bench, Path()) == PathValidity(True, False)
    with pytest.raises(CallFailed, match="layer: must be '' or 'static', is 'voxels'"):
        validity(bench, LINE, layer="voxels")


def test_a_path_in_a_foreign_frame_is_refused(bench: Bench) -> None:
    foreign = replace(LINE, frame="mars")
    with pytest.raises(CallFailed, match="path: the frame must be map or odom, is 'mars'"):
        validity(bench, foreign)
    smoothed = bench.do("smooth_path", SmoothPath(foreign), SmoothedPath)
    assert smoothed.error_code == SmoothError.INVALID_PATH
    assert "the frame must be map or odom, is 'mars'" in smoothed.error_msg


def test_a_round_robot_has_the_same_cost_in_every_direction() -> None:
    cells = np.zeros((80, 80), dtype=np.int8)
    cells[44, 44] = 100  # from 0.28 m away on, in a corner of the square around a disc of 0.25 m
    terrain = Terrain.of(OccupancyGrid(cells, 0.05, 0.0, 0.0), Inflation.of(0.25, 0.6), True)
    disc = Footprint.disc(0.25)
    assert {footprint_cost(Pose2D(2.0, 2.0, yaw), disc, terrain) for yaw in np.linspace(0.0, 6.0, 25)} == {0.0}
    assert footprint_cost(Pose2D(2.1, 2.1), disc, terrain) == LETHAL


def test_costs_are_those_of_nav2s_scale() -> None:
    with Rig() as rig:
        bench = Bench.of(rig, START, [*ROOM, BLOCK])
        free, near, touching, within, beyond = costs(bench, (0.6, 0.6), (0.9, 2.0), (1.06, 2.0), (2.0, 2.0), (9.0, 9.0))
        assert free == 0.0
        assert 0.0 < near < 253.0
        assert (touching, within, beyond) == (253.0, 254.0, 255.0)
        assert costs(bench, (0.6, 0.6), (1.2, 2.0), outline=True)[1] == 254.0


def test_clearing_forgets_what_was_seen_until_the_next_scan_shows_it(bench: Bench) -> None:
    bench.surprise(CHAIR)
    bench.run(1.0)
    assert costs(bench, (1.8, 2.0)) == (254.0,)
    cleared = bench.rig.call(CLEAR, ClearCostmap(), CostmapCleared)
    assert cleared.success
    assert cleared.cleared > 3
    assert costs(bench, (1.8, 2.0)) == (0.0,)
    bench.run(1.0)
    assert costs(bench, (1.8, 2.0)) == (254.0,)


@pytest.mark.parametrize(
    ("name", "asked", "clears"),
    [
        ("except", ClearCostmap(4.0), False),
        ("except", ClearCostmap(1.0), True),
        ("around", ClearCostmap(1.0), False),
        ("around", ClearCostmap(4.0), True),
        ("around_pose", ClearCostmap(1.0, framed(0.6, 2.0)), False),
        ("around_pose", ClearCostmap(1.0, framed(2.0, 2.0)), True),
    ],
)
def test_the_service_decides_where_the_map_is_cleared(
    bench: Bench, name: str, asked: ClearCostmap, clears: bool
) -> None:
    bench.surprise(CHAIR)
    bench.run(1.0)
    bench.stage.scans = False
    cleared = bench.rig.call(f"global_costmap/clear_{name}_global_costmap", asked, CostmapCleared).cleared
    assert (cleared > 3) is clears
    assert (costs(bench, (1.8, 2.0)) == (0.0,)) is clears


@pytest.mark.parametrize(
    ("name", "asked", "field"),
    [
        ("entirely", ClearCostmap(2.0), "reset_distance"),
        ("entirely", ClearCostmap(around=framed(2.0, 2.0)), "around"),
        ("except", ClearCostmap(1.0, framed(2.0, 2.0)), "around"),
        ("around", ClearCostmap(1.0, framed(2.0, 2.0)), "around"),
        ("around_pose", ClearCostmap(1.0), "around"),
        ("around_pose", ClearCostmap(1.0, framed(2.0, 2.0, frame="kitchen")), "around"),
    ],
)
def test_a_request_for_another_area_or_frame_clears_nothing(
    bench: Bench, name: str, asked: ClearCostmap, field: str
) -> None:
    bench.surprise(CHAIR)
    bench.run(1.0)
    bench.stage.scans = False
    with pytest.raises(CallFailed) as refused:
        bench.rig.call(f"global_costmap/clear_{name}_global_costmap", asked, CostmapCleared)
    assert (refused.value.code, refused.value.field) == (RefusalCode.INVALID, field)
    assert costs(bench, (1.8, 2.0)) == (254.0,)


def corner() -> Path:
    xs, ys = np.arange(0.6, 2.01, 0.05), np.arange(2.05, 3.3, 0.05)
    points = [(x, 2.0) for x in xs.tolist()] + [(2.0, y) for y in ys.tolist()]
    return Path(0.0, "map", tuple(PlanarPose(x, y, math.pi / 2) for x, y in points))


@pytest.mark.parametrize("smoother", ["", "simple_smoother", "route_smoother"])
def test_smoothing_rounds_corners_and_keeps_the_ends(bench: Bench, smoother: str) -> None:
    done = bench.do("smooth_path", SmoothPath(corner(), smoother), SmoothedPath)
    rows = done.path.rows
    assert done.was_completed
    assert rows[[0, -1], :2].tolist() == corner().rows[[0, -1], :2].tolist()
    assert rows[-1, 2] == pytest.approx(math.pi / 2)
    turns = np.abs(np.diff(rows[:-1, 2]))
    assert turns.max() < 0.5


def test_smoothing_that_cannot_be_is_reported(bench: Bench) -> None:
    short = bench.do("smooth_path", SmoothPath(Path(0.0, "map", (PlanarPose(1.0, 1.0),))), SmoothedPath)
    assert short.error_code == SmoothError.INVALID_PATH
    unknown = bench.do("smooth_path", SmoothPath(corner(), "simple"), SmoothedPath)
    assert unknown.error_code == SmoothError.INVALID_SMOOTHER
    assert "simple_smoother" in unknown.error_msg


def test_a_smoothed_path_through_something_fails_where_that_is_asked_for(bench: Bench) -> None:
    bench.surprise(Box(2.0, 2.6, 0.3, 0.3))
    bench.run(1.0)
    goal = SmoothPath(corner(), check_for_collisions=True)
    assert bench.do("smooth_path", goal, SmoothedPath).error_code == SmoothError.SMOOTHED_PATH_IN_COLLISION


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(x=st.floats(0.0, 4.0), y=st.floats(0.0, 4.0), yaw=st.floats(-3.1, 3.1))
def test_every_path_that_is_found_is_valid(bench: Bench, x: float, y: float, yaw: float) -> None:
    found = bench.plan(x, y, yaw)
    assert found.error_code == 0, "in an empty room each goal can be approached"
    assert validity(bench, found.path).is_valid
