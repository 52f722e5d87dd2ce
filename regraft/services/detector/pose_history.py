"""Where the robot was when a picture was taken."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Iterable

from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.sensors import Odometry

KEPT = 100
"""Messages: 5 s at 20 Hz, longer than a picture may be under way."""
MAX_GAP = 0.5
"""s between two messages beyond which the way between them is not known."""
MAX_AHEAD = 0.25
"""s by which a picture may be newer than the newest message: the corrected pose comes later than the picture."""


class PoseHistory:
    """The robot's latest poses, seen from above."""

    def __init__(self) -> None:
        self._known: deque[Odometry] = deque(maxlen=KEPT)

    def add(self, messages: Iterable[Odometry]) -> None:
        """Take in messages, oldest first; time that goes backwards or another frame begins a new history."""
        for message in messages:
            last = self._known[-1] if self._known else None
            if last is not None and (message.stamp < last.stamp or message.frame != last.frame):
                self._known.clear()
            self._known.append(message)

    def at(self, stamp: float) -> Pose | None:
        """Return the pose at a time (s): between two messages on the line, a little after the last by its speed.

        None if no message is near enough.
        """
        after = bisect_left(self._known, stamp, key=lambda message: message.stamp)
        if after == len(self._known):
            return _ahead(self._known[-1], stamp) if self._known else None
        following = self._known[after]
        if following.stamp == stamp:
            return following.pose
        if after == 0 or following.stamp - self._known[after - 1].stamp > MAX_GAP:
            return None
        return _between(self._known[after - 1], following, stamp)


def _between(one: Odometry, other: Odometry, stamp: float) -> Pose:
    share = (stamp - one.stamp) / (other.stamp - one.stamp)
    turned = math.remainder(other.pose.yaw - one.pose.yaw, math.tau)
    return Pose.planar(
        one.pose.x + share * (other.pose.x - one.pose.x),
        one.pose.y + share * (other.pose.y - one.pose.y),
        one.pose.yaw + share * turned,
    )


def _ahead(last: Odometry, stamp: float) -> Pose | None:
    seconds = stamp - last.stamp
    if seconds > MAX_AHEAD:
        return None
    way = last.twist.forward * seconds
    heading = last.pose.yaw + last.twist.turn * seconds / 2.0
    x, y = last.pose.x + way * math.cos(heading), last.pose.y + way * math.sin(heading)
    return Pose.planar(x, y, last.pose.yaw + last.twist.turn * seconds)
