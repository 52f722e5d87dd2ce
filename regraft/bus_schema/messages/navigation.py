"""The action ``navigate_to``: drive to a pose."""

from __future__ import annotations

from dataclasses import dataclass

from regraft.bus_schema.annotations import Count, Metres, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.geometry import FramedPose, Pose


@message("regraft/NavigateTo")
@dataclass(frozen=True, slots=True)
class NavigateTo:
    """Goal: be at ``goal``."""

    goal: FramedPose


@message("regraft/NavigationProgress")
@dataclass(frozen=True, slots=True)
class NavigationProgress:
    """Feedback: how far it still is, along the path, what the robot is doing, and how often it had to recover."""

    distance_left: Metres
    time_left: Seconds
    phase: str
    recoveries: Count = 0


@message("regraft/Arrival")
@dataclass(frozen=True, slots=True)
class Arrival:
    """Result: where the drive ended (in the goal's frame), whether that is the goal, and why not."""

    arrived: bool
    pose: Pose
    reason: str = ""
