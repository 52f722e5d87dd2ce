"""Nav2's conditions that only need the blackboard and the clock, with the semantics of its C++ plugins.

Where Nav2 asks ROS for the robot's pose, a condition has the further input ``pose``, ``{@robot_pose}`` by default.
"""

from typing import Final

from ...node_registry import Registry
from ...nodes.node import Node
from .error_codes import (
    AreErrorCodesPresent,
    WouldAControllerRecoveryHelp,
    WouldAPlannerRecoveryHelp,
    WouldARouteRecoveryHelp,
    WouldASmootherRecoveryHelp,
)
from .goals import GlobalUpdatedGoal, GoalReached, GoalUpdated, InitialPoseReceived
from .poses import ArePosesNear, IsGoalNearby, IsWithinPathTrackingBounds
from .progress import DistanceTraveled, PathExpiringTimer, TimeExpired

NAV2_CONDITIONS: Final[tuple[type[Node], ...]] = (
    AreErrorCodesPresent,
    ArePosesNear,
    DistanceTraveled,
    GlobalUpdatedGoal,
    GoalReached,
    GoalUpdated,
    InitialPoseReceived,
    IsGoalNearby,
    IsWithinPathTrackingBounds,
    PathExpiringTimer,
    TimeExpired,
    WouldAControllerRecoveryHelp,
    WouldAPlannerRecoveryHelp,
    WouldARouteRecoveryHelp,
    WouldASmootherRecoveryHelp,
)


def register_nav2_conditions(registry: Registry) -> tuple[str, ...]:
    """Register Nav2's conditions under Nav2's names.

    Args:
        registry: The registry that they are added to.

    Returns:
        The names that are left out, because the registry has node types of these names already.
    """
    taken = tuple(each.__name__ for each in NAV2_CONDITIONS if each.__name__ in registry.manifests)
    for node_class in NAV2_CONDITIONS:
        if node_class.__name__ not in taken:
            registry.register(node_class)
    return taken


__all__ = ["NAV2_CONDITIONS", "register_nav2_conditions"]
