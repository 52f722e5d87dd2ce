"""The statuses of waypoints, as a mission through several poses keeps them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from regraft.bus_schema.messages.nav2.navigate import WaypointState, WaypointStatus
from regraft.services.bt_executor.leaves.nav2.poses import pose_of


def marked(statuses: Sequence[WaypointStatus], goals: Iterable[Any], state: str) -> list[WaypointStatus]:
    """Return the statuses with the first pending waypoint at each of some goals in another state.

    Raises:
        ValueError: no pending waypoint is at a goal.
    """
    found = list(statuses)
    for goal in goals:
        pose = pose_of(goal)
        for index, each in enumerate(found):
            if each.status is WaypointState.PENDING and each.pose == pose:
                found[index] = replace(each, status=WaypointState(state))
                break
        else:
            raise ValueError(f"no pending waypoint is at ({pose.pose.x:g}, {pose.pose.y:g})")
    return found
