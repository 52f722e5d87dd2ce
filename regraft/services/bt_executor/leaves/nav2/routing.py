"""The leaves that ask the route server, and that read routes."""

from __future__ import annotations

from typing import Any

from behavior_tree import FAILURE, SUCCESS, Input, Output, Status, SyncAction
from regraft.bus_schema.messages.geometry import FramedPose, Pose
from regraft.bus_schema.messages.nav2.paths import Path
from regraft.bus_schema.messages.nav2.routes import ComputedRoute, ComputeRoute, Route, RouteError
from regraft.services.bt_executor.leaves.asking_leaf import write_if_connected
from regraft.services.bt_executor.leaves.context import Asked
from regraft.services.bt_executor.leaves.nav2.poses import MAP_FRAME, pose_at_or_none
from regraft.services.bt_executor.leaves.nav2.server_leaf import ServerAction


class ComputeRouteLeaf(ServerAction):
    """Asks for a way over the graph of places."""

    server = "compute_route"
    unknown = int(RouteError.UNKNOWN)

    start = Input[Any](description="where from; by default where the robot is")
    goal = Input[Any](description="where to, with use_poses")
    start_id = Input(int, default=0, description="the node to begin at")
    goal_id = Input(int, default=0, description="the node to end at")
    use_start = Input(bool, default=False, description="whether start or start_id count")
    use_poses = Input(bool, default=False, description="whether poses count, not ids")
    route = Output[Any](description="the nodes of the way")
    found = Output[Any](name="path", description="the path along its edges")
    planning_time = Output(float, description="seconds that it took, always 0: simulated time stands still meanwhile")

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        goal = ComputeRoute(
            pose_at_or_none(self, "start"),
            pose_at_or_none(self, "goal"),
            self.start_id,
            self.goal_id,
            self.use_start,
            self.use_poses,
        )
        return self.give(goal, ComputedRoute)

    def answered(self, answer: ComputedRoute) -> Status:
        """Write the route; without one, an empty one."""
        write_if_connected(self, "route", answer.route)
        write_if_connected(self, "path", answer.path)
        write_if_connected(self, "planning_time", 0.0)
        return self.ended(answer)

    def aborted(self, code: int, why: str) -> Status:
        """Write that there is no route."""
        write_if_connected(self, "route", Route())
        write_if_connected(self, "path", Path())
        return super().aborted(code, why)


class ExtractRouteNodesAsGoals(SyncAction):
    """Makes goals of the nodes of a route; fails if it has none."""

    route = Input[Any](description="the route")
    goals = Output[Any](description="the list of goals")

    def tick(self) -> Status:
        """Write the goals."""
        route = self.read_port_or("route")
        if route is not None and not isinstance(route, Route):
            raise ValueError(f"port 'route' holds {type(route).__name__}, must hold a Route")
        if route is None or not route.nodes:
            return FAILURE
        self.goals = [FramedPose(MAP_FRAME, Pose.planar(node.x, node.y, 0.0)) for node in route.nodes]
        return SUCCESS
