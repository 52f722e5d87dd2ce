"""Paths: computing, checking, smoothing and following them.

Goals, results and error codes have the names and numbers of Nav2's actions (nav2_msgs). Trees written for Nav2 decide
by them. The number 0 is no error.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from regraft.bus_schema.annotations import Count, Metres, MetresPerSecond, Radians, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.geometry import FramedPose, Pose

MAX_POSES = 20_000
"""Poses of one path: a kilometre at 0.05 m."""
MAX_GOALS = 1_000
"""Goals of one path through poses."""


class PlanError(IntEnum):
    """The error codes of ``compute_path_to_pose``; those of ``compute_path_through_poses`` are 100 higher."""

    NONE = 0
    REJECTED = 1
    NOT_SENT = 2
    UNKNOWN = 200
    INVALID_PLANNER = 201
    NO_POSE = 202
    START_OUTSIDE_MAP = 203
    GOAL_OUTSIDE_MAP = 204
    START_OCCUPIED = 205
    GOAL_OCCUPIED = 206
    TIMEOUT = 207
    NO_VALID_PATH = 208


THROUGH_POSES = 100
"""By how much the error codes of paths through poses are higher than `PlanError`."""
NO_VIAPOINTS = 309
"""The error code of ``compute_path_through_poses`` for a goal without poses."""


class FollowError(IntEnum):
    """The error codes of ``follow_path``."""

    NONE = 0
    REJECTED = 1
    NOT_SENT = 2
    UNKNOWN = 100
    INVALID_CONTROLLER = 101
    NO_POSE = 102
    INVALID_PATH = 103
    PATIENCE_EXCEEDED = 104
    FAILED_TO_MAKE_PROGRESS = 105
    NO_VALID_CONTROL = 106
    CONTROLLER_TIMED_OUT = 107
    TIMEOUT = 108


class SmoothError(IntEnum):
    """The error codes of ``smooth_path``."""

    NONE = 0
    REJECTED = 1
    NOT_SENT = 2
    UNKNOWN = 500
    INVALID_SMOOTHER = 501
    TIMEOUT = 502
    SMOOTHED_PATH_IN_COLLISION = 503
    FAILED_TO_SMOOTH_PATH = 504
    INVALID_PATH = 505


@message("regraft/PlanarPose")
@dataclass(frozen=True, slots=True)
class PlanarPose:
    """A place and a heading in the plane z = 0."""

    x: Metres
    y: Metres
    yaw: Radians = 0.0


@message("regraft/Path")
@dataclass(frozen=True, slots=True)
class Path:
    """A way in ``frame``, made at ``stamp``; two are equal that lead the same way, whenever they were made."""

    stamp: Seconds = field(default=0.0, compare=False)
    frame: str = "map"
    poses: tuple[PlanarPose, ...] = ()

    def __post_init__(self) -> None:
        if len(self.poses) > MAX_POSES:
            raise BadMessage(f"must have at most {MAX_POSES} poses, has {len(self.poses)}", ("poses",))

    @classmethod
    def of(cls, stamp: Seconds, frame: str, rows: NDArray[np.float64]) -> Path:
        """Return the path along rows (N, 3) of x (m), y (m) and yaw (rad)."""
        return cls(stamp, frame, tuple(PlanarPose(x, y, yaw) for x, y, yaw in rows.tolist()))

    @property
    def rows(self) -> NDArray[np.float64]:
        """The poses as rows (N, 3) of x (m), y (m) and yaw (rad)."""
        return np.array([(each.x, each.y, each.yaw) for each in self.poses], np.float64).reshape(-1, 3)

    def pose(self, index: int) -> FramedPose:
        """Return one of its poses; raises IndexError."""
        each = self.poses[index]
        return FramedPose(self.frame, Pose.planar(each.x, each.y, each.yaw))


@message("regraft/ComputePathToPose")
@dataclass(frozen=True, slots=True)
class ComputePathToPose:
    """Goal: find a way to ``goal``, from where the robot is or from ``start``.

    ``viapoints`` are passed on the way. ``planner`` names how to plan; empty is the first.
    """

    goal: FramedPose
    start: FramedPose | None = None
    viapoints: tuple[FramedPose, ...] = ()
    planner: str = ""


@message("regraft/ComputePathThroughPoses")
@dataclass(frozen=True, slots=True)
class ComputePathThroughPoses:
    """Goal: find a way through ``goals`` in their order, from where the robot is or from ``start``."""

    goals: tuple[FramedPose, ...]
    start: FramedPose | None = None
    planner: str = ""


@message("regraft/ComputedPath")
@dataclass(frozen=True, slots=True)
class ComputedPath:
    """Result: the way, or without one the error's code and text."""

    path: Path = Path()
    error_code: Count = 0
    error_msg: str = ""


@message("regraft/FollowPath")
@dataclass(frozen=True, slots=True)
class FollowPath:
    """Goal: drive along ``path`` to its last pose. A newer path replaces it without a stop.

    Each name chooses one of those that the controller server has; an empty one is the first.
    """

    path: Path
    controller: str = ""
    goal_checker: str = ""
    progress_checker: str = ""
    path_handler: str = ""


@message("regraft/TrackingFeedback")
@dataclass(frozen=True, slots=True)
class TrackingFeedback:
    """Feedback: how well the path is followed.

    ``position_tracking_error`` is positive left of the path. ``heading_tracking_error`` is positive where the robot is
    turned to the right of the path's direction.
    """

    position_tracking_error: Metres = 0.0
    heading_tracking_error: Radians = 0.0
    current_path_index: Count = 0
    robot_pose: FramedPose | None = None
    distance_to_goal: Metres = 0.0
    speed: MetresPerSecond = 0.0
    remaining_path_length: Metres = 0.0


@message("regraft/PathFollowed")
@dataclass(frozen=True, slots=True)
class PathFollowed:
    """Result: whether the end of the path is reached; ``cancelled`` by another than its client, or the error."""

    error_code: Count = 0
    error_msg: str = ""
    cancelled: bool = False


@message("regraft/SmoothPath")
@dataclass(frozen=True, slots=True)
class SmoothPath:
    """Goal: round the corners of ``path`` where that stays clear of obstacles.

    ``check_for_collisions``: fail where the result touches something. ``smoother`` names how; empty is the first.
    """

    path: Path
    smoother: str = ""
    max_duration: Seconds = 3.0
    check_for_collisions: bool = False


@message("regraft/SmoothedPath")
@dataclass(frozen=True, slots=True)
class SmoothedPath:
    """Result: the rounded path, or the error."""

    path: Path = Path()
    duration: Seconds = 0.0
    was_completed: bool = False
    error_code: Count = 0
    error_msg: str = ""


@message("regraft/ValidatePath")
@dataclass(frozen=True, slots=True)
class ValidatePath:
    """Request: whether a robot can still drive along ``path``.

    Costs are those of `Costs`; a pose with ``max_cost`` or more is invalid. Only the first ``max_lookahead_distance``
    (m) from the robot on count, or all of it where that is negative. ``layer`` is ``static`` for the map alone, and
    empty for the map with the obstacles that were seen.
    """

    path: Path
    max_cost: Count = 254
    consider_unknown_as_obstacle: bool = False
    layer: str = ""
    stop_at_first_collision: bool = True
    max_lookahead_distance: Metres = -1.0


@message("regraft/PathValidity")
@dataclass(frozen=True, slots=True)
class PathValidity:
    """Reply: whether the path could be looked at, whether it is valid, and the indices of the poses that are not."""

    success: bool
    is_valid: bool
    invalid_pose_indices: tuple[Count, ...] = ()


@message("regraft/GetCosts")
@dataclass(frozen=True, slots=True)
class GetCosts:
    """Request: the costs of places; with ``use_footprint`` those of the robot's outline there."""

    poses: tuple[FramedPose, ...]
    use_footprint: bool = True


@message("regraft/Costs")
@dataclass(frozen=True, slots=True)
class Costs:
    """Reply: the cost of each place as in Nav2's costmaps.

    0 is free, 253 nearer to an obstacle than the robot's radius, 254 in an obstacle, 255 unknown. Between them the cost
    falls with the distance.
    """

    success: bool
    costs: tuple[float, ...] = ()


@message("regraft/ClearCostmap")
@dataclass(frozen=True, slots=True)
class ClearCostmap:
    """Request: forget the obstacles that were seen and that the map lacks; the next scan shows those that are there.

    The service decides where: everywhere, in a square around the robot, outside of it, or in one around the pose
    ``around``. The square's side is ``reset_distance`` (m). A service refuses what it has no use for.
    """

    reset_distance: Metres = 0.0
    around: FramedPose | None = None


@message("regraft/CostmapCleared")
@dataclass(frozen=True, slots=True)
class CostmapCleared:
    """Reply: whether it was cleared, and how many marks of obstacles were forgotten."""

    success: bool
    cleared: Count = 0
