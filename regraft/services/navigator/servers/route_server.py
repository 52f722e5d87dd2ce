"""The route server: ways over a graph of places that somebody has drawn into the map."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from regraft import Component, Input, Parameter, ParameterError, Records, action
from regraft.bus_schema.messages.geometry import FramedPose
from regraft.bus_schema.messages.nav2.paths import MAX_POSES, Path
from regraft.bus_schema.messages.nav2.routes import (
    ComputedRoute,
    ComputeRoute,
    Route,
    RouteEdge,
    RouteError,
    RouteNode,
)
from regraft.bus_schema.messages.sensors import Odometry
from regraft.bus_schema.model.description import Resources
from regraft.planar import FloatArray, Point
from regraft.services.navigator.planning.smoothing import subdivide
from regraft.services.navigator.servers.paths import path_of
from regraft.services.navigator.servers.surroundings import check_frame

DENSITY = 0.05
"""m between the poses of a route's path."""

Links = Mapping[int, Mapping[int, float]]


class NoRoute(Exception):
    """There is no route; ``code`` is for programs."""

    def __init__(self, code: RouteError, why: str) -> None:
        super().__init__(why)
        self.code = code


class RouteServer(Component):
    """Finds the cheapest way over a graph: the nodes, and the dense path along its straight edges.

    It knows neither map nor obstacles. Whether a route is free is what the planner server's ``is_path_valid`` states.
    """

    resources = Resources(cpu=0.01, memory=25.0)

    nodes = Records(RouteNode, "the places of the graph")
    edges = Records(RouteEdge, "the ways between them")

    odometry = Input(Odometry, latest_only=True, description="where a route begins: at the robot")

    @classmethod
    def parameters_for(cls, parameters: dict[str, Any]) -> Iterable[Parameter[Any]]:
        """Add none; raises ParameterError for two nodes of one id, and for wrong edges."""
        ids = [node.id for node in parameters["nodes"]]
        wrong = [(f"nodes.{index}.id", f"{each} is twice") for index, each in enumerate(ids) if each in ids[:index]]
        for index, edge in enumerate(parameters["edges"]):
            if not edge.cost > 0.0:
                wrong.append((f"edges.{index}.cost", f"must be greater than 0, is {edge.cost:g}"))
            for end in ("start", "end"):
                if getattr(edge, end) not in ids:
                    known = ", ".join(map(str, ids)) or "none"
                    wrong.append((f"edges.{index}.{end}", f"there is no node {getattr(edge, end)}; there are: {known}"))
        if wrong:
            raise ParameterError(wrong)
        return ()

    def on_configure(self) -> None:
        """Link the nodes."""
        self._nodes = {node.id: node for node in self.nodes}
        self._links: dict[int, dict[int, float]] = {node.id: {} for node in self.nodes}
        for edge in self.edges:
            cost = edge.cost * _distance(self._nodes[edge.start], _place(self._nodes[edge.end]))
            for one, other in ((edge.start, edge.end), (edge.end, edge.start))[: 1 + edge.both_ways]:
                self._links[one][other] = min(cost, self._links[one].get(other, math.inf))

    @action("compute_route")
    async def compute_route(self, goal: ComputeRoute) -> ComputedRoute:
        """Find a way over the graph."""
        try:
            if not self._nodes:
                raise NoRoute(RouteError.NO_VALID_GRAPH, "the graph has no nodes; the parameter 'nodes' lists them")
            first, last = self._ends(goal)
            ids, cost = _cheapest(self._links, first, last)
            route = Route(tuple(self._nodes[each] for each in ids), cost)
            return ComputedRoute(route, self._path(route))
        except NoRoute as error:
            return ComputedRoute(error_code=int(error.code), error_msg=str(error))

    def _ends(self, goal: ComputeRoute) -> tuple[int, int]:
        if goal.use_poses:
            last = self._nearest(self._given("goal", goal.goal))
            start = self._given("start", goal.start) if goal.use_start else self._robot()
            return self._nearest(start), last
        last = self._known("goal_id", goal.goal_id)
        return self._known("start_id", goal.start_id) if goal.use_start else self._nearest(self._robot()), last

    def _given(self, name: str, pose: FramedPose | None) -> Point:
        if pose is None:
            raise NoRoute(RouteError.NO_POSE, f"the goal needs a pose '{name}'")
        try:
            check_frame(name, pose.frame)
        except ValueError as error:
            raise NoRoute(RouteError.NO_POSE, str(error)) from None
        return pose.pose.x, pose.pose.y

    def _robot(self) -> Point:
        odometry = self.odometry.latest
        if odometry is None:
            raise NoRoute(RouteError.NO_POSE, "no odometry has come")
        return odometry.pose.x, odometry.pose.y

    def _known(self, name: str, node: int) -> int:
        if node not in self._nodes:
            why = f"{name}: there is no node {node}; there are: {', '.join(map(str, self._nodes))}"
            raise NoRoute(RouteError.UNKNOWN_NODE, why)
        return node

    def _nearest(self, place: Point) -> int:
        return min(self._nodes, key=lambda each: _distance(self._nodes[each], place))

    def _path(self, route: Route) -> Path:
        """Return the path along a route; raises NoRoute for one that is too long."""
        length, yaw = 0.0, 0.0
        for one, other in pairwise(route.nodes):
            length += _distance(one, _place(other))
            yaw = math.atan2(other.y - one.y, other.x - one.x)
        points: FloatArray = np.array([_place(node) for node in route.nodes])
        # The length comes first: a million kilometres of points have no room.
        if length > MAX_POSES * DENSITY or len(points := subdivide(points, DENSITY)) > MAX_POSES:
            why = f"the route is {length:g} m long; a path has {MAX_POSES} poses at most, one each {DENSITY:g} m"
            raise NoRoute(RouteError.UNKNOWN, why)
        return path_of(self.kit.now(), points, yaw)


def _cheapest(links: Links, first: int, last: int) -> tuple[list[int], float]:
    """Return the nodes of the cheapest way, and its cost (Dijkstra 1959); raises NoRoute."""
    costs = {first: 0.0}
    before: dict[int, int] = {}
    ahead = [(0.0, first)]
    while ahead:
        cost, here = heapq.heappop(ahead)
        if here == last:
            break
        if cost > costs[here]:
            continue
        for there, more in links[here].items():
            if cost + more < costs.get(there, math.inf):
                costs[there], before[there] = cost + more, here
                heapq.heappush(ahead, (cost + more, there))
    if last not in costs:
        raise NoRoute(RouteError.NO_VALID_ROUTE, f"no edges lead from node {first} to node {last}")
    way = [last]
    while way[-1] != first:
        way.append(before[way[-1]])
    return way[::-1], costs[last]


def _place(node: RouteNode) -> Point:
    return node.x, node.y


def _distance(node: RouteNode, place: Point) -> float:
    return math.dist(_place(node), place)
