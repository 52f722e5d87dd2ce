"""Whole drives by a behaviour tree: the actions ``navigate_to_pose`` and ``navigate_through_poses``.

Names and error codes are those of Nav2's navigators (nav2_msgs). The number 0 is no error.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum

from regraft.bus_schema.annotations import Count, Metres, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.geometry import FramedPose


class NavigateError(IntEnum):
    """The error codes of ``navigate_to_pose``; those of ``navigate_through_poses`` are 100 higher.

    Where the tree has left a code of its own, such as that of its planner, the result has that.
    """

    NONE = 0
    REJECTED = 1
    NOT_SENT = 2
    UNKNOWN = 9000
    BAD_TREE = 9001
    NO_POSE = 9002
    TIMEOUT = 9003


class WaypointState(Enum):
    """How it stands with one of several goals."""

    PENDING = "pending"
    COMPLETED = "completed"
    SKIPPED = "skipped"
    FAILED = "failed"


@message("regraft/WaypointStatus")
@dataclass(frozen=True, slots=True)
class WaypointStatus:
    """How it stands with one of several goals; ``index`` is its place among them."""

    index: Count
    pose: FramedPose
    status: WaypointState = WaypointState.PENDING


@message("regraft/NavigateToPose")
@dataclass(frozen=True, slots=True)
class NavigateToPose:
    """Goal: be at ``pose``. ``behavior_tree`` is the file of the tree that drives; empty is the navigator's own."""

    pose: FramedPose
    behavior_tree: str = ""


@message("regraft/NavigateThroughPoses")
@dataclass(frozen=True, slots=True)
class NavigateThroughPoses:
    """Goal: pass ``poses`` in their order and be at the last. ``behavior_tree`` is as in ``regraft/NavigateToPose``."""

    poses: tuple[FramedPose, ...]
    behavior_tree: str = ""


@message("regraft/NavigationFeedback")
@dataclass(frozen=True, slots=True)
class NavigationFeedback:
    """Feedback: where the robot is, how long the drive took so far, and how far it still is along the path.

    ``recoveries`` counts the motions of recovery: turns, ways back and waits.
    """

    current_pose: FramedPose | None
    navigation_time: Seconds
    distance_remaining: Metres
    recoveries: Count = 0
    poses_remaining: Count = 0


@message("regraft/Navigated")
@dataclass(frozen=True, slots=True)
class Navigated:
    """Result: how it stands with the goals, or the error."""

    error_code: Count = 0
    error_msg: str = ""
    waypoint_statuses: tuple[WaypointStatus, ...] = ()
