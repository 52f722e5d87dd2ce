"""The route server: the cheapest way over a graph, and what is wrong with graphs and goals."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regraft import ParameterError
from regraft.bus_schema.messages.nav2.paths import MAX_POSES
from regraft.bus_schema.messages.nav2.routes import ComputedRoute, ComputeRoute, RouteError
from regraft.component.goal import Goal
from regraft.planar import Pose2D
from regraft.services.navigator.servers.route_server import RouteServer
from regraft.testing import Rig

from .bench import Bench, add, framed

NODES = [{"id": 1, "x": 0.0, "y": 0.0}, {"id": 2, "x": 2.0, "y": 0.0}, {"id": 3, "x": 2.0, "y": 2.0},
         {"id": 4, "x": 0.0, "y": 2.0}, {"id": 5, "x": 9.0, "y": 9.0}]  # fmt: skip
EDGES = [{"start": 1, "end": 2}, {"start": 2, "end": 3}, {"start": 3, "end": 4, "both_ways": False},
         {"start": 1, "end": 3, "cost": 2.0}]  # fmt: skip


def computed(goal: ComputeRoute, nodes: Any = NODES, edges: Any = EDGES) -> ComputedRoute:
    with Rig() as rig:
        bench = Bench.of(rig, Pose2D(0.4, 0.4, 0.0))
        add(rig, RouteServer, "routes", nodes=nodes, edges=edges)
        bench.run(0.1)
        return bench.do("compute_route", goal, ComputedRoute, within=1.0)


def ids(found: ComputedRoute) -> list[int]:
    return [node.id for node in found.route.nodes]


def test_the_cheapest_way_is_found_and_its_path_is_dense() -> None:
    found = computed(ComputeRoute(start_id=1, goal_id=3, use_start=True))
    assert ids(found) == [1, 2, 3], "the direct edge costs twice its length"
    assert found.route.cost == pytest.approx(4.0)
    rows = found.path.rows
    assert rows[0, :2].tolist() == [0.0, 0.0]
    assert rows[-1].tolist() == pytest.approx([2.0, 2.0, np.pi / 2])
    assert np.hypot(*np.diff(rows[:, :2], axis=0).T).max() < 0.051


def test_a_route_begins_at_the_node_nearest_to_the_robot_and_ends_at_that_of_the_goal() -> None:
    assert ids(computed(ComputeRoute(goal=framed(1.8, 1.7), use_poses=True))) == [1, 2, 3]
    between = ComputeRoute(start=framed(2.1, 0.1), goal=framed(0.0, 2.2), use_start=True, use_poses=True)
    assert ids(computed(between)) == [2, 3, 4]


def test_a_route_to_where_the_robot_is_has_one_node() -> None:
    found = computed(ComputeRoute(goal_id=1))
    assert ids(found) == [1]
    assert len(found.path.poses) == 1


@pytest.mark.parametrize(
    ("goal", "code", "why"),
    [
        (ComputeRoute(goal_id=9), RouteError.UNKNOWN_NODE, "goal_id: there is no node 9; there are: 1, 2, 3, 4, 5"),
        (ComputeRoute(goal_id=5), RouteError.NO_VALID_ROUTE, "no edges lead from node 1 to node 5"),
        (ComputeRoute(start_id=4, goal_id=1, use_start=True), RouteError.NO_VALID_ROUTE, "from node 4"),
        (ComputeRoute(use_poses=True), RouteError.NO_POSE, "the goal needs a pose 'goal'"),
        (ComputeRoute(goal=framed(1.0, 1.0, frame="moon"), use_poses=True), RouteError.NO_POSE, "is 'moon'"),
    ],
)
def test_a_route_that_cannot_be_is_reported(goal: ComputeRoute, code: RouteError, why: str) -> None:
    found = computed(goal)
    assert found.error_code == code
    assert why in found.error_msg


@pytest.mark.parametrize(("far", "poses", "code"), [(999.0, 19_981, 0), (1_100.0, 0, 400), (1e9, 0, 400)])
def test_a_route_whose_path_is_too_long_is_reported(far: float, poses: int, code: int) -> None:
    nodes = [{"id": 1, "x": 0.0, "y": 0.0}, {"id": 2, "x": far, "y": 0.0}]
    found = computed(ComputeRoute(start_id=1, goal_id=2, use_start=True), nodes, [{"start": 1, "end": 2}])
    assert (len(found.path.poses), found.error_code) == (poses, code)
    assert (str(MAX_POSES) in found.error_msg) is (code != 0)


def test_an_empty_graph_has_no_routes() -> None:
    assert computed(ComputeRoute(goal_id=1), [], []).error_code == RouteError.NO_VALID_GRAPH


@pytest.mark.parametrize(
    ("nodes", "edges", "why"),
    [
        ([NODES[0], NODES[0]], [], "1 is twice"),
        (NODES, [{"start": 1, "end": 8}], "there is no node 8; there are: 1, 2, 3, 4, 5"),
        (NODES, [{"start": 1, "end": 2, "cost": 0.0}], "must be greater than 0"),
    ],
)
def test_a_graph_that_is_none_is_refused_with_the_field(nodes: Any, edges: Any, why: str) -> None:
    with Rig() as rig, pytest.raises(ParameterError, match=why):
        rig.add(RouteServer, "routes", {"nodes": nodes, "edges": edges})


@given(
    links=st.lists(st.tuples(st.integers(1, 5), st.integers(1, 5)), max_size=12),
    first=st.integers(1, 5),
    last=st.integers(1, 5),
)
def test_a_route_follows_edges_and_costs_their_lengths(links: list[tuple[int, int]], first: int, last: int) -> None:
    edges = [{"start": one, "end": other} for one, other in links]
    with Rig() as rig:
        rig.add(RouteServer, "routes", {"nodes": NODES, "edges": edges})
        wanted = ComputeRoute(start_id=first, goal_id=last, use_start=True)
        goal: Goal[ComputedRoute, Any] = rig.goal("compute_route", wanted, ComputedRoute)
        found = goal.result
    assert found is not None
    if found.error_code:
        assert found.error_code == RouteError.NO_VALID_ROUTE
        return
    assert (ids(found)[0], ids(found)[-1]) == (first, last)
    allowed = {*links, *((other, one) for one, other in links)}
    assert all(step in allowed for step in pairwise(ids(found)))
    rows = found.path.rows
    assert found.route.cost == pytest.approx(float(np.hypot(*np.diff(rows[:, :2], axis=0).T).sum()))
