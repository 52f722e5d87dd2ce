"""Poses, goals and paths as blackboard entries may hold them, to messages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from behavior_tree import Node
from regraft.bus_schema.messages.geometry import FramedPose, Pose, StampedPose
from regraft.bus_schema.messages.maps import Goals, NamedGoal
from regraft.bus_schema.messages.nav2.paths import Path

MAP_FRAME = "map"
POSE = "it must hold a goal, a pose, or numbers: x;y or x;y;yaw"


def pose_of(value: Any) -> FramedPose:
    """Return a pose from a message, from numbers ``[x, y, yaw]`` (m, rad; yaw may be missing), or from a text of these.

    Raises:
        ValueError: it has another form.
    """
    if isinstance(value, NamedGoal):
        return value.pose
    if isinstance(value, FramedPose):
        return value
    if isinstance(value, StampedPose):
        return FramedPose(value.frame, value.pose)
    if isinstance(value, Pose):
        return FramedPose(MAP_FRAME, value)
    parts = value.split(";") if isinstance(value, str) else value
    try:
        numbers = [float(part) for part in parts]
    except (TypeError, ValueError):
        raise ValueError(f"{value!r} is no pose; {POSE}") from None
    if len(numbers) not in (2, 3) or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{value!r} is no pose; {POSE}")
    x, y, yaw = (*numbers, 0.0)[:3]
    return FramedPose(MAP_FRAME, Pose.planar(x, y, yaw))


def goals_of(value: Any) -> list[Any]:
    """Return goals one by one, from a message or a list; none from None. Raises ValueError."""
    if value is None:
        return []
    if isinstance(value, Goals):
        return list(value.goals)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return list(value)
    raise ValueError(f"{value!r} is no list of goals")


def pose_at(node: Node, port: str) -> FramedPose:
    """Return the pose of an input; raises PortError where it is unset, ValueError where it holds no pose."""
    value = node.read_port(port)
    try:
        return pose_of(value)
    except ValueError as error:
        raise ValueError(f"port '{port}': {error}") from None


def pose_at_or_none(node: Node, port: str) -> FramedPose | None:
    """Return the pose of an input, None where it is unset; raises ValueError."""
    return None if node.read_port_or(port) is None else pose_at(node, port)


def path_at(node: Node, port: str) -> Path:
    """Return the path of an input, an empty one where it is unset; raises ValueError."""
    value = node.read_port_or(port)
    if value is None:
        return Path()
    if not isinstance(value, Path):
        raise ValueError(f"port '{port}' holds {type(value).__name__}, must hold a Path")
    return value
