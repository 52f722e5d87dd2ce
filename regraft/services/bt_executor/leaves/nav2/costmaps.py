"""The leaves that clear costmaps, and those that ask for costs."""

from __future__ import annotations

from typing import Any

from behavior_tree import SUCCESS, Input, Output, Status
from regraft.bus_schema.messages.nav2.paths import ClearCostmap, CostmapCleared, Costs, GetCosts
from regraft.services.bt_executor.leaves.asking_leaf import write_if_connected
from regraft.services.bt_executor.leaves.context import Asked
from regraft.services.bt_executor.leaves.nav2.poses import goals_of, pose_at, pose_of
from regraft.services.bt_executor.leaves.nav2.recoveries import count_recovery
from regraft.services.bt_executor.leaves.nav2.server_leaf import ServerCall
from regraft.services.bt_executor.leaves.nav2.waypoints import marked

UNKNOWN = 255.0
COST_SERVICE = "global_costmap/get_cost_global_costmap"


class ClearEntireCostmap(ServerCall):
    """Has a costmap forget the obstacles that were seen; the map itself stays, and the next scan shows what is there.

    Nav2's input ``plugins`` chooses layers. Here one layer can be cleared, so it has no effect.
    """

    plugins = Input[Any](description="not used here: one layer can be cleared")

    def ask(self) -> Asked[Any]:
        """Call the service."""
        count_recovery(self)
        return self.call(self.request(), CostmapCleared)

    def request(self) -> ClearCostmap:
        """Return what to clear."""
        return ClearCostmap()

    def answered(self, answer: CostmapCleared) -> Status:
        """Succeed if it was cleared."""
        return SUCCESS if answer.success else self.failed("the costmap was not cleared")


class _ClearBySquare(ClearEntireCostmap):
    """The base of what clears by a square around the robot: the service decides which side of it."""

    reset_distance = Input(float, default=1.0, description="side of the square, in metres")

    def request(self) -> ClearCostmap:
        """Return what to clear."""
        return ClearCostmap(self.reset_distance)


class ClearCostmapExceptRegion(_ClearBySquare):
    """Clears a costmap but for a square around the robot."""


class ClearCostmapAroundRobot(_ClearBySquare):
    """Clears a square of a costmap around the robot."""


class ClearCostmapAroundPose(ClearEntireCostmap):
    """Clears a square of a costmap around a pose."""

    required_ports = ("pose",)

    pose = Input[Any](description="the middle of the square")
    reset_distance = Input(float, default=1.0, description="side of the square, in metres")

    def request(self) -> ClearCostmap:
        """Return what to clear."""
        return ClearCostmap(self.reset_distance, around=pose_at(self, "pose"))


class _CostLeaf(ServerCall):
    """The base of what looks at costs: which of them is too high."""

    service = COST_SERVICE

    cost_threshold = Input(float, default=254.0, description="the cost from which on a place is occupied")
    use_footprint = Input(bool, default=True, description="whether the robot's outline counts, or its middle")
    consider_unknown_as_obstacle = Input(bool, default=False, description="whether unknown ground is occupied")

    def is_occupied(self, cost: float) -> bool:
        """Return whether a place of that cost is occupied."""
        if cost == UNKNOWN:
            return bool(self.consider_unknown_as_obstacle)
        return bool(cost >= self.cost_threshold)


class CheckPoseOccupancy(_CostLeaf):
    """Succeeds if a pose is occupied, fails if it is free, as in Nav2."""

    required_ports = ("pose",)

    pose = Input[Any](description="the pose")

    def ask(self) -> Asked[Any]:
        """Ask for the cost."""
        return self.call(GetCosts((pose_at(self, "pose"),), self.use_footprint), Costs)

    def answered(self, answer: Costs) -> Status:
        """Compare the cost."""
        if not answer.success:
            return self.failed("the cost is not known")
        return SUCCESS if self.is_occupied(answer.costs[0]) else self.failed("the pose is free")


class RemoveInCollisionGoals(_CostLeaf):
    """Takes goals out of a list that are occupied; fails where the costs are not known."""

    required_ports = ("input_goals",)

    input_goals = Input[Any](description="the list")
    output_goals = Output[Any](description="the list without them")
    input_waypoint_statuses = Input[Any](description="the statuses of all waypoints")
    output_waypoint_statuses = Output[Any](description="the same, with those left out marked as skipped")

    def ask(self) -> Asked[Any]:
        """Ask for the costs."""
        self._goals = goals_of(self.read_port_or("input_goals"))
        return self.call(GetCosts(tuple(map(pose_of, self._goals)), self.use_footprint), Costs)

    def answered(self, answer: Costs) -> Status:
        """Write the goals that stay."""
        if not answer.success:
            return self.failed("the costs are not known")
        pairs = list(zip(self._goals, answer.costs, strict=True))
        write_if_connected(self, "output_goals", [goal for goal, cost in pairs if not self.is_occupied(cost)])
        statuses = self.read_port_or("input_waypoint_statuses")
        if statuses is not None:
            gone = [goal for goal, cost in pairs if self.is_occupied(cost)]
            write_if_connected(self, "output_waypoint_statuses", marked(statuses, gone, "skipped"))
        return SUCCESS
