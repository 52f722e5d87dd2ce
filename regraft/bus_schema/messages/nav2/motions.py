"""Motions without a path: turning, driving straight, waiting, driving by hand.

Their error codes are those of Nav2's behaviours (nav2_msgs). The number 0 is no error.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from regraft.bus_schema.annotations import Count, Metres, MetresPerSecond, Radians, Seconds
from regraft.bus_schema.encoding.registry import message


class MotionError(IntEnum):
    """The ways to fail; each motion has its own codes for them: `SPIN` and so on."""

    UNKNOWN = 0
    TIMEOUT = 1
    NO_POSE = 2
    COLLISION_AHEAD = 3
    INVALID_INPUT = 4


SPIN = {
    MotionError.UNKNOWN: 700,
    MotionError.TIMEOUT: 701,
    MotionError.NO_POSE: 702,
    MotionError.COLLISION_AHEAD: 703,
    MotionError.INVALID_INPUT: 700,
}
BACK_UP = {
    MotionError.UNKNOWN: 710,
    MotionError.TIMEOUT: 711,
    MotionError.NO_POSE: 712,
    MotionError.INVALID_INPUT: 713,
    MotionError.COLLISION_AHEAD: 714,
}
DRIVE_ON_HEADING = {
    MotionError.UNKNOWN: 720,
    MotionError.TIMEOUT: 721,
    MotionError.NO_POSE: 722,
    MotionError.COLLISION_AHEAD: 723,
    MotionError.INVALID_INPUT: 724,
}
ASSISTED_TELEOP = {
    MotionError.UNKNOWN: 730,
    MotionError.TIMEOUT: 731,
    MotionError.NO_POSE: 732,
    MotionError.COLLISION_AHEAD: 730,
    MotionError.INVALID_INPUT: 730,
}
WAIT = {
    MotionError.UNKNOWN: 740,
    MotionError.TIMEOUT: 741,
    MotionError.NO_POSE: 740,
    MotionError.COLLISION_AHEAD: 740,
    MotionError.INVALID_INPUT: 740,
}


@message("regraft/Spin")
@dataclass(frozen=True, slots=True)
class Spin:
    """Goal: turn in place by ``target_yaw``, to the left where it is positive, within ``time_allowance``."""

    target_yaw: Radians = 1.57
    time_allowance: Seconds = 10.0
    disable_collision_checks: bool = False


@message("regraft/DriveStraight")
@dataclass(frozen=True, slots=True)
class DriveStraight:
    """Goal: drive straight by ``distance`` at ``speed``, within ``time_allowance``.

    Of ``drive_on_heading`` both have the same sign, and negative ones lead back. Of ``backup`` they count as negative.
    """

    distance: Metres = 0.15
    speed: MetresPerSecond = 0.025
    time_allowance: Seconds = 10.0
    disable_collision_checks: bool = False


@message("regraft/AssistedTeleop")
@dataclass(frozen=True, slots=True)
class AssistedTeleop:
    """Goal: drive as the topic of the input ``teleop`` states, but never into anything, for ``time_allowance``."""

    time_allowance: Seconds = 10.0


@message("regraft/Wait")
@dataclass(frozen=True, slots=True)
class Wait:
    """Goal: stand for ``time``."""

    time: Seconds = 1.0


@message("regraft/MotionProgress")
@dataclass(frozen=True, slots=True)
class MotionProgress:
    """Feedback: how far (m, or rad of a turn) the robot has come, and how long it took."""

    travelled: float = 0.0
    elapsed: Seconds = 0.0


@message("regraft/MotionDone")
@dataclass(frozen=True, slots=True)
class MotionDone:
    """Result: how long it took; ``cancelled`` by another than its client, or the error."""

    total_elapsed_time: Seconds = 0.0
    error_code: Count = 0
    error_msg: str = ""
    cancelled: bool = False


@message("regraft/CancelGoals")
@dataclass(frozen=True, slots=True)
class CancelGoals:
    """Request: end the goal that an action pursues, of any client."""


@message("regraft/GoalsCancelled")
@dataclass(frozen=True, slots=True)
class GoalsCancelled:
    """Reply: how many goals were ended."""

    count: Count


@message("regraft/Selection")
@dataclass(frozen=True, slots=True)
class Selection:
    """The name of the planner, controller or checker to use from now on."""

    name: str
