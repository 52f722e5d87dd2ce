"""Nav2's leaves that act on the bus, with its names, ports and error codes: docs/nav2.md has them all.

They ask the servers of `regraft.services.navigator.servers`, or any others that offer the same actions and services.
"""

from __future__ import annotations

from typing import Final

from behavior_tree import Node
from regraft.services.bt_executor.leaves.nav2 import (
    behaviours,
    costmaps,
    goal_lists,
    navigating,
    path_editing,
    planning,
    robot_state,
    routing,
    selectors,
)
from regraft.services.bt_executor.leaves.nav2.following import FollowPathLeaf

NAV2_LEAVES: Final[dict[str, type[Node]]] = {
    "AppendGoalPoseToGoals": goal_lists.AppendGoalPoseToGoals,
    "AssistedTeleop": behaviours.AssistedTeleopLeaf,
    "BackUp": behaviours.BackUpLeaf,
    "CancelAssistedTeleop": behaviours.CancelAssistedTeleop,
    "CancelBackUp": behaviours.CancelBackUp,
    "CancelControl": behaviours.CancelControl,
    "CancelDriveOnHeading": behaviours.CancelDriveOnHeading,
    "CancelSpin": behaviours.CancelSpin,
    "CancelWait": behaviours.CancelWait,
    "CheckPoseOccupancy": costmaps.CheckPoseOccupancy,
    "CheckStopStatus": robot_state.CheckStopStatus,
    "ClearCostmapAroundPose": costmaps.ClearCostmapAroundPose,
    "ClearCostmapAroundRobot": costmaps.ClearCostmapAroundRobot,
    "ClearCostmapExceptRegion": costmaps.ClearCostmapExceptRegion,
    "ClearEntireCostmap": costmaps.ClearEntireCostmap,
    "ComputePathThroughPoses": planning.ComputePathThroughPosesLeaf,
    "ComputePathToPose": planning.ComputePathToPoseLeaf,
    "ComputeRoute": routing.ComputeRouteLeaf,
    "ConcatenatePaths": path_editing.ConcatenatePaths,
    "ControllerSelector": selectors.ControllerSelector,
    "DriveOnHeading": behaviours.DriveOnHeadingLeaf,
    "ExtractRouteNodesAsGoals": routing.ExtractRouteNodesAsGoals,
    "FollowPath": FollowPathLeaf,
    "GetCurrentPose": robot_state.GetCurrentPose,
    "GetNextFewGoals": goal_lists.GetNextFewGoals,
    "GetPoseFromPath": path_editing.GetPoseFromPath,
    "GoalCheckerSelector": selectors.GoalCheckerSelector,
    "IsBatteryCharging": robot_state.IsBatteryCharging,
    "IsBatteryLow": robot_state.IsBatteryLow,
    "IsPathValid": planning.ValidatePathLeaf,  # ValidatePath in Nav2 up to Kilted
    "IsStuck": robot_state.IsStuck,
    "NavigateThroughPoses": navigating.NavigateThroughPosesLeaf,
    "NavigateToPose": navigating.NavigateToPoseLeaf,
    "PathHandlerSelector": selectors.PathHandlerSelector,
    "PlannerSelector": selectors.PlannerSelector,
    "ProgressCheckerSelector": selectors.ProgressCheckerSelector,
    "RemoveInCollisionGoals": costmaps.RemoveInCollisionGoals,
    "RemovePassedGoals": goal_lists.RemovePassedGoals,
    "SmoothPath": planning.SmoothPathLeaf,
    "SmootherSelector": selectors.SmootherSelector,
    "Spin": behaviours.SpinLeaf,
    "TransformAvailable": robot_state.TransformAvailable,
    "TruncatePath": path_editing.TruncatePath,
    "TruncatePathLocal": path_editing.TruncatePathLocal,
    "ValidatePath": planning.ValidatePathLeaf,
    "Wait": behaviours.WaitLeaf,
}
"""Nav2's leaves by their names in XML."""
